// What the panel says of an answer, a place or a pair.
import type { Api, Candidate, GeoPose, MapInfo, Pair, PlaceDetails, SeenAnswer } from './api.ts';
import { bestOf, type AnswerStore } from './answers.ts';
import { make, percent, svg } from './dom.ts';
import { drawContext, drawOverlay } from './figures.ts';
import { yawOf } from './geometry.ts';
import { markSvg, OUTCOMES } from './palette.ts';

export interface DetailContext {
  api: Api;
  info: MapInfo;
  answers: AnswerStore;
  dark: boolean;
  placeOf: (place: number) => Promise<PlaceDetails>;
  goToPlace: (place: number) => void;
  goTo: (x: number, y: number) => void;
  close: () => void;
}

function titled(context: DetailContext, title: (Node | string)[]): HTMLElement {
  return make('div', {},
      make('button', { type: 'button', class: 'close', 'aria-label': 'Close (Escape)', click: context.close }, '×'),
      make('h2', {}, ...title));
}

function list(entries: [string, string][]): HTMLElement {
  return make('dl', {}, ...entries.flatMap(([name, value]) => [make('dt', {}, name), make('dd', {}, value)]));
}

export function timeText(ns: number): string {
  return ns > 0 ? new Date(ns / 1e6).toLocaleString() : 'unknown';
}

function onEarth(geo: GeoPose | undefined): [string, string][] {
  if (!geo) return [];
  return [['on earth', `${geo.latitude.toFixed(7)}, ${geo.longitude.toFixed(7)}, ${geo.altitude_m.toFixed(1)} m, ` +
      `heading ${geo.heading_deg.toFixed(1)}°`]];
}

export function outcomeMark(outcome: keyof typeof OUTCOMES, dark: boolean, size = 14): Element {
  const { mark, light, dark: inDark } = OUTCOMES[outcome];
  return svg(markSvg(mark, dark ? inDark : light, dark ? '#1c2026' : '#ffffff', size));
}

function figureOf(context: DetailContext, seen: SeenAnswer, candidate: Candidate, rank: number): HTMLElement {
  const canvas = make('canvas', {
    role: 'img', 'aria-label': `The scan laid on place ${candidate.place}`, width: '480', height: '480',
  });
  const caption = make('figcaption', {},
      `${rank === 0 ? 'Best' : `Rival ${rank}`}: `,
      make('button', { type: 'button', click: () => context.goToPlace(candidate.place) }, `place ${candidate.place}`),
      ` (${candidate.session}), confidence ${percent(candidate.confidence)}`);
  void context.placeOf(candidate.place).then((place) => {
    const { ofScan, ofPlace } = drawOverlay(canvas, seen.posts_cm, candidate, place, context.dark);
    caption.append(`; ${percent(ofScan)} of the scan lies on the place, ${percent(ofPlace)} of the place on the scan`);
  }, (error: Error) => caption.append(`; ${error.message}`));
  return make('figure', rank === 0 ? { class: 'wide' } : {}, canvas, caption);
}

export function answerDetail(context: DetailContext, seen: SeenAnswer): HTMLElement {
  const { answer } = seen;
  const best = bestOf(answer);
  const box = titled(context, [outcomeMark(answer.outcome, context.dark), ` ${OUTCOMES[answer.outcome].name}`]);
  box.append(make('p', { class: 'reason' }, answer.reason || 'no reason was given'));
  const facts: [string, string][] = [['robot', seen.client], ['request', seen.request_id], ['when', timeText(seen.answered_ns)]];
  if (best) {
    const spread = best.std_x_m === undefined ? '' :
        ` ±\u00a0${Math.hypot(best.std_x_m, best.std_y_m ?? 0).toFixed(2)}\u00a0m, ±\u00a0${best.std_yaw_deg?.toFixed(1)}°`;
    facts.push(
        ['confidence', `${percent(best.confidence)}; ${percent(context.info.min_confidence)} is asked for`],
        ['pose', `${best.T_map_query.x.toFixed(2)}, ${best.T_map_query.y.toFixed(2)} m, ` +
            `${(yawOf(best.T_map_query) * 180 / Math.PI).toFixed(1)}°${spread}`],
        ...onEarth(best.geo));
  }
  box.append(list(facts));
  if (best) {
    box.append(make('p', {}, make('button', {
      type: 'button', click: () => context.goTo(best.T_map_query.x, best.T_map_query.y),
    }, 'Show on the map')));
  }
  if (answer.candidates.length > 0 && seen.posts_cm.length > 0) {
    box.append(make('h3', {}, 'The scan on the place: dots agree with the map (grey), crosses do not'));
    box.append(make('div', { class: 'figures' },
        ...answer.candidates.map((candidate, rank) => figureOf(context, seen, candidate, rank))));
  } else if (answer.candidates.length === 0) {
    box.append(make('p', {}, 'There is no place to compare with.'));
  }
  return box;
}

export function placeDetail(context: DetailContext, place: PlaceDetails): HTMLElement {
  const box = titled(context, [`Place ${place.place}`]);
  const health = context.answers.healthOf(place.place);
  box.append(list([
    ['session', context.info.sessions[place.session] ?? String(place.session)],
    ['mapped', timeText(place.stamp_ns)],
    ['position', `${place.T_map_place.x.toFixed(2)}, ${place.T_map_place.y.toFixed(2)}, ` +
        `${place.T_map_place.z.toFixed(2)} m, ${(yawOf(place.T_map_place) * 180 / Math.PI).toFixed(1)}°`],
    ...onEarth(place.geo),
    ['found', health?.found ? `${health.found} times, confidence ${percent(health.confidence)} on the average, ` +
        `last ${timeText(health.lastNs)}` : 'not yet, as far as is known here'],
    ...(health?.refused ? [['refused', `${health.refused} queries that were most likely here`] as [string, string]] : []),
    ...(health?.disagreement ?
      [['changed', `${percent(health.disagreement)} of the structure disagreed lately`] as [string, string]] : []),
    ['structure', `${place.posts_cm.length / 2} posts`],
  ]));
  box.append(make('p', {}, make('button', {
    type: 'button', click: () => context.goTo(place.T_map_place.x, place.T_map_place.y),
  }, 'Show on the map')));
  const figures = make('div', { class: 'figures' });
  for (const [name, told, axes] of [
    ['Polar context', place.polar, 'azimuth from ahead, range upwards'],
    ['Cart context', place.cart, 'left to right, ahead upwards']] as const) {
    if (!told) continue;
    const canvas = make('canvas', { role: 'img', 'aria-label': name });
    const highest = drawContext(canvas, told);
    figures.append(make('figure', { class: 'wide' }, canvas, make('figcaption', {},
        `${name}: ${axes}; heights up to ${(highest / 100).toFixed(1)} m, the lighter the higher`)));
  }
  if (figures.childElementCount > 0) box.append(make('h3', {}, 'Contexts'), figures);
  return box;
}

export function pairDetail(context: DetailContext, pair: Pair): HTMLElement {
  const apart = Math.hypot(pair.from.x - pair.to.x, pair.from.y - pair.to.y);
  const box = titled(context, ['Places that look alike']);
  const end = (place: number, at: { x: number; y: number }) => make('p', {}, make('button', {
    type: 'button', click: () => { context.goTo(at.x, at.y); context.goToPlace(place); },
  }, `Place ${place}`), ` at ${at.x.toFixed(1)}, ${at.y.toFixed(1)} m`);
  box.append(end(pair.place, pair.from), end(pair.lookalike, pair.to), make('p', {},
      `${apart.toFixed(0)} m apart. Were place ${pair.place} not in the map, ${pair.lookalike} would be given ` +
      `for it with a confidence of ${percent(pair.confidence)}.`));
  return box;
}
