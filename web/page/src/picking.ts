// What is under the pointer.
import type { Pair, SeenAnswer, TileSquare } from './api.ts';
import { bestOf } from './answers.ts';
import type { Rows } from './tiles.ts';

export type Picked =
    { kind: 'place'; place: number } | { kind: 'answer'; answer: SeenAnswer } |
    { kind: 'pair'; pair: Pair };

export interface Spot { x: number; y: number; answer: SeenAnswer }

const REACH_PX = 9;
const ANSWER_REACH_PX = 11;
const PATH_REACH_PX = 6;

type At = [number, number];

/** Where the best candidates of answers are. */
export function spotsOf(answers: SeenAnswer[]): Spot[] {
  return answers.flatMap((answer) => {
    const best = bestOf(answer.answer);
    return best ? [{ x: best.T_map_query.x, y: best.T_map_query.y, answer }] : [];
  });
}

/** The nearest thing to the point, all in the same frame [m]; answers before pairs before places. */
export function pickAt(at: At, pxPerM: number, spots: Spot[], paths: { pair: Pair; path: At[] }[],
                       squares: { square: TileSquare; rows: Rows }[],
                       isShown: (rows: Rows, i: number) => boolean): Picked | null {
  const far = (x: number, y: number) => Math.hypot(x - at[0], y - at[1]) * pxPerM;
  return pickAnswer(spots, far) ?? pickPair(paths, far) ?? pickPlace(at, REACH_PX / pxPerM, squares, far, isShown);
}

type Far = (x: number, y: number) => number;

function pickAnswer(spots: Spot[], far: Far): Picked | null {
  let nearest = ANSWER_REACH_PX;
  let found: Picked | null = null;
  for (const { x, y, answer } of spots) {
    const distance = far(x, y);
    if (distance > nearest) continue;
    nearest = distance;
    found = { kind: 'answer', answer };
  }
  return found;
}

function pickPair(paths: { pair: Pair; path: At[] }[], far: Far): Picked | null {
  const isNear = (path: At[]) => path.some(([x, y], i) => i > 0 && [0.25, 0.5, 0.75, 1].some((t) => {
    const [px, py] = path[i - 1];
    return far(px + t * (x - px), py + t * (y - py)) < PATH_REACH_PX;
  }));
  const found = paths.find(({ path }) => isNear(path));
  return found ? { kind: 'pair', pair: found.pair } : null;
}

function pickPlace(at: At, reach: number, squares: { square: TileSquare; rows: Rows }[], far: Far,
                   isShown: (rows: Rows, i: number) => boolean): Picked | null {
  let nearest = REACH_PX;
  let place = -1;
  for (const { square: { x, y, side }, rows } of squares) {
    if (at[0] < x - reach || at[0] > x + side + reach || at[1] < y - reach || at[1] > y + side + reach) continue;
    for (let i = 0; i < rows.count; ++i) {
      const distance = far(rows.position[3 * i], rows.position[3 * i + 1]);
      if (distance > nearest || !isShown(rows, i)) continue;
      nearest = distance;
      place = rows.place[i];
    }
  }
  return place < 0 ? null : { kind: 'place', place };
}
