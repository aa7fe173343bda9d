import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { Pair, SeenAnswer, TileSquare } from '../src/api.ts';
import { pickAt } from '../src/picking.ts';
import { decodeRows, type Rows } from '../src/tiles.ts';
import { scaleFor } from '../src/scale.ts';

const SQUARE: TileSquare = { level: 0, x: 0, y: 0, side: 100, count: 2 };

function rowsAt(...points: [number, number][]): Rows {
  const rows = decodeRows(new ArrayBuffer(24 * points.length));
  points.forEach(([x, y], i) => {
    rows.position.set([x, y, 0], 3 * i);
    rows.place[i] = 10 + i;
  });
  return rows;
}

test('the nearest place within some pixels is picked, if it is shown', () => {
  const squares = [{ square: SQUARE, rows: rowsAt([50, 50], [52, 50]) }];
  const pick = (x: number, y: number, isShown = (_: Rows, i: number) => i >= 0) => pickAt([x, y], 2, [], [], squares, isShown);
  assert.deepEqual(pick(51.5, 50), { kind: 'place', place: 11 });
  assert.deepEqual(pick(51.5, 50, (_, i) => i === 0), { kind: 'place', place: 10 });
  assert.equal(pick(60, 50), null);
});

test('answers go before pairs, and pairs before places', () => {
  const squares = [{ square: SQUARE, rows: rowsAt([50, 50]) }];
  const pair = { place: 1 } as Pair;
  const paths = [{ pair, path: [[0, 50], [100, 50]] as [number, number][] }];
  const answer = { number: 5 } as SeenAnswer;
  const always = () => true;
  assert.deepEqual(pickAt([50, 50], 1, [{ x: 51, y: 50, answer }], paths, squares, always), { kind: 'answer', answer });
  assert.deepEqual(pickAt([50, 50], 1, [], paths, squares, always), { kind: 'pair', pair });
  assert.deepEqual(pickAt([50, 50], 1, [], [], squares, always), { kind: 'place', place: 10 });
});

test('the scale is round and has room', () => {
  assert.deepEqual(scaleFor(1), { metres: 100, text: '100 m' });
  assert.deepEqual(scaleFor(0.05), { metres: 2000, text: '2 km' });
  assert.equal(scaleFor(200).text, '0.5 m');
});
