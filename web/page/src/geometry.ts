import type { Pose } from './api.ts';

/** Counter-clockwise from the map's x axis [rad]. */
export function yawOf(pose: Pose): number {
  return Math.atan2(2 * (pose.qw * pose.qz + pose.qx * pose.qy),
                    1 - 2 * (pose.qy * pose.qy + pose.qz * pose.qz));
}

/** Posts (x, y of one after the other [cm], in the frame of the pose) in the map [m]. */
export function postsInMap(posts_cm: number[], pose: Pose): Float32Array {
  const cos = Math.cos(yawOf(pose));
  const sin = Math.sin(yawOf(pose));
  const placed = new Float32Array(posts_cm.length);
  for (let i = 0; i + 1 < posts_cm.length; i += 2) {
    const x = posts_cm[i] / 100;
    const y = posts_cm[i + 1] / 100;
    placed[i] = pose.x + cos * x - sin * y;
    placed[i + 1] = pose.y + sin * x + cos * y;
  }
  return placed;
}

/** Of each post of `query`, whether one of `place` is within reach. */
export function agreement(query: Float32Array, place: Float32Array, reach: number): boolean[] {
  const cells = new Map<string, number[]>();
  const key = (x: number, y: number) => `${Math.floor(x / reach)},${Math.floor(y / reach)}`;
  for (let i = 0; i + 1 < place.length; i += 2) {
    const cell = key(place[i], place[i + 1]);
    const list = cells.get(cell);
    if (list) list.push(i); else cells.set(cell, [i]);
  }
  const agrees: boolean[] = [];
  for (let i = 0; i + 1 < query.length; i += 2) {
    let near = false;
    for (let dx = -1; dx <= 1 && !near; ++dx) {
      for (let dy = -1; dy <= 1 && !near; ++dy) {
        const list = cells.get(key(query[i] + dx * reach, query[i + 1] + dy * reach));
        near = list?.some((j) => Math.hypot(place[j] - query[i], place[j + 1] - query[i + 1]) <= reach) ?? false;
      }
    }
    agrees.push(near);
  }
  return agrees;
}

/** A bow from one end to the other, to the left of the way. */
export function arc(from: [number, number], to: [number, number], numPoints = 24): [number, number][] {
  const bend: [number, number] = [
    (from[0] + to[0]) / 2 - (to[1] - from[1]) * 0.18,
    (from[1] + to[1]) / 2 + (to[0] - from[0]) * 0.18,
  ];
  return Array.from({ length: numPoints }, (_, i) => {
    const t = i / (numPoints - 1);
    const at = (axis: 0 | 1) =>
        (1 - t) * (1 - t) * from[axis] + 2 * t * (1 - t) * bend[axis] + t * t * to[axis];
    return [at(0), at(1)] as [number, number];
  });
}

/** How wide and high the name of a rival is on the screen [px]. */
const NAME_PX = [52, 16];

/** What stands at the best spot and its rivals, given in their order; spots too near to each other for two names
 *  share one, at the first of them. */
export function nameRivals(spots: [number, number][], pxPerM: number): { first: number; text: string }[] {
  const groups: number[][] = [];
  spots.forEach(([x, y], i) => {
    const group = groups.find(([first]) => Math.abs(spots[first][0] - x) * pxPerM < NAME_PX[0] &&
        Math.abs(spots[first][1] - y) * pxPerM < NAME_PX[1]);
    if (group) group.push(i);
    else groups.push([i]);
  });
  return groups.map((group) => {
    const rivals = group.filter((i) => i > 0);
    const names = [...(group[0] === 0 ? ['best'] : []),
      ...(rivals.length > 0 ? [`rival${rivals.length > 1 ? 's' : ''} ${rivals.join(', ')}`] : [])];
    return { first: group[0], text: names.join(', ') };
  });
}
