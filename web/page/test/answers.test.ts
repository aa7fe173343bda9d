import assert from 'node:assert/strict';
import { test } from 'node:test';
import { EventParser, type Outcome, type SeenAnswer } from '../src/api.ts';
import { AnswerStore, placeNamed } from '../src/answers.ts';

const POSE = { x: 0, y: 0, z: 0, qx: 0, qy: 0, qz: 0, qw: 1 };

function seen(client: string, x: number, outcome: Outcome = 'localized', seconds = 0): SeenAnswer {
  return {
    number: 1, answered_ns: seconds * 1e9, request_id: `request-of-${client}`, client, is_of_stream: false, posts_cm: [],
    answer: {
      map: 'town', content_id: '', outcome, reason: '',
      candidates: [{ place: x, session: 'monday', distance: 0, confidence: 0.5, T_map_place: POSE, T_map_query: { ...POSE, x } }],
    },
  };
}

test('a trail is of one robot, and ends where it could not have gone on', () => {
  const store = new AnswerStore();
  for (const x of [0, 10, 20]) store.add(seen('a', x, 'localized', x));
  store.add(seen('b', 21));
  store.add(seen('a', 500, 'localized', 21));
  store.add(seen('a', 505, 'localized', 22));
  store.add(seen('a', 510, 'localized', 2000));
  assert.deepEqual(store.trails().map(({ client, points }) => [client, points.map(([x]) => x)]),
      [['a', [0, 10, 20]], ['a', [500, 505]]]);
});

test('an answer to the page itself counts once, whichever way it comes first', () => {
  for (const order of [[0, 7], [7, 0]]) {
    const store = new AnswerStore();
    const [first, second] = order.map((number) => ({ ...seen('a', 3), number, request_id: 'page-1' }));
    assert.equal(store.add(first), first);
    assert.equal(store.add(second), first);
    assert.deepEqual([store.all.length, store.countOf('localized'), store.healthOf(3)?.found], [1, 1, 1]);
  }
  const store = new AnswerStore();  // a robot that keeps its request id
  for (const number of [1, 2]) store.add({ ...seen('a', 3), number, request_id: 'drive' });
  assert.equal(store.all.length, 2);
});

test('a lost robot is shown where it was last', () => {
  const store = new AnswerStore();
  store.add(seen('a', 7));
  store.add(seen('a', 90, 'not_recognized'));
  store.add(seen('never-found', 90, 'not_recognized'));
  assert.deepEqual(store.lostSpots().map(({ client, x }) => [client, x]), [['a', 7]]);
});

test('places tell how often they were found, by answers that are sure', () => {
  const store = new AnswerStore();
  store.add(seen('a', 3));
  store.add(seen('a', 3));
  store.add(seen('a', 3, 'ambiguous'));
  assert.deepEqual(store.healthOf(3), { found: 2, confidence: 0.5, lastNs: 0, refused: 0, disagreement: 0 });
  assert.equal(store.healthOf(4), undefined);
});

test('search finds by robot, request, session, place and outcome', () => {
  const store = new AnswerStore();
  store.add(seen('token:mule', 12));
  store.add(seen('token:ox', 13, 'not_recognized'));
  const found = (text: string) => store.search(text).map(({ client }) => client);
  assert.deepEqual(found('mule'), ['token:mule']);
  assert.deepEqual(found('REQUEST-of-token:ox'), ['token:ox']);
  assert.deepEqual(found('monday place 12'), ['token:mule']);
  assert.deepEqual(found('not recognized'), ['token:ox']);
  assert.deepEqual(found(''), ['token:ox', 'token:mule']);
});

test('answers are kept up to a bound', () => {
  const store = new AnswerStore();
  for (let i = 0; i < 2500; ++i) store.add(seen('a', i));
  assert.equal(store.all.length, 2000);
  assert.equal(store.all[0].answer.candidates[0].place, 500);
});

test('a place is named by its number', () => {
  assert.equal(placeNamed('12', 20), 12);
  assert.equal(placeNamed(' place #12 ', 20), 12);
  for (const text of ['20', 'place', '1.5', 'twelve', '']) assert.equal(placeNamed(text, 20), null);
});

test('events are told however the stream is cut', () => {
  const text = ': nothing new\n\nid: run:1\nevent: answer\ndata: {"a":1}\n\nid: run:2\ndata: {"a":2}\n\n';
  for (let size = 1; size <= text.length; ++size) {
    const told: string[] = [];
    const parser = new EventParser((data, id) => told.push(`${id} ${data}`));
    for (let at = 0; at < text.length; at += size) parser.push(text.slice(at, at + size));
    assert.deepEqual(told, ['run:1 {"a":1}', 'run:2 {"a":2}']);
  }
});

test('what the server counted goes before what came here until then', () => {
  const store = new AnswerStore();
  store.add(seen('a', 3, 'localized', 10));
  store.setUse({ until_ns: 20e9, places: [
    { place: 3, num_found: 40, num_refused: 2, confidence: 0.75, recent_disagreement: 0.5, last_found_ns: 10e9 },
    { place: 4, num_found: 0, num_refused: 1, confidence: 0, recent_disagreement: 0, last_found_ns: 0 },
  ] });
  const before = store.revision;
  store.add(seen('a', 3, 'localized', 15));
  assert.deepEqual(store.healthOf(3), { found: 40, confidence: 0.75, lastNs: 10e9, refused: 2, disagreement: 0.5 });
  store.add(seen('a', 3, 'localized', 30));
  assert.equal(store.healthOf(3)?.found, 41);
  assert.equal(store.healthOf(4)?.confidence, 0);
  assert.notEqual(store.revision, before);
});
