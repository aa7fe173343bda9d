// Which squares of places a view needs, and what their rows say.
import type { Api, TileList, TileSquare } from './api.ts';

/** What is on the screen: a box in metres from the origin, and how many pixels a metre has. */
export interface View { minX: number; minY: number; maxX: number; maxY: number; pxPerM: number }

export interface Rows {
  count: number;
  place: Uint32Array;
  /** x, y and height [m from the origin], place after place. */
  position: Float32Array;
  stamp: Uint32Array;
  maxStamp: number;
  session: Uint16Array;
  heading: Float32Array;
}

/** A square is drawn once its sample, a place in each cell of 48 x 48, would be seen as such. */
const MIN_SIDE_PX = 200;
const ROW_BYTES = 24;

export function decodeRows(bytes: ArrayBuffer): Rows {
  const count = Math.floor(bytes.byteLength / ROW_BYTES);
  const view = new DataView(bytes);
  const rows: Rows = {
    count,
    place: new Uint32Array(count),
    position: new Float32Array(3 * count),
    stamp: new Uint32Array(count),
    maxStamp: 0,
    session: new Uint16Array(count),
    heading: new Float32Array(count),
  };
  for (let i = 0, at = 0; i < count; ++i, at += ROW_BYTES) {
    rows.place[i] = view.getUint32(at, true);
    for (let axis = 0; axis < 3; ++axis) {
      rows.position[3 * i + axis] = view.getFloat32(at + 4 + 4 * axis, true);
    }
    rows.stamp[i] = view.getUint32(at + 16, true);
    rows.maxStamp = Math.max(rows.maxStamp, rows.stamp[i]);
    rows.session[i] = view.getUint16(at + 20, true);
    rows.heading[i] = (view.getUint16(at + 22, true) / 65536) * 2 * Math.PI;
  }
  return rows;
}

/** Numbers of the squares that the view shows and that are large enough on it; coarse ones first. */
export function chooseTiles(tiles: TileSquare[], view: View): number[] {
  const chosen: number[] = [];
  tiles.forEach((tile, i) => {
    if (tile.count === 0) return;
    if (tile.level > 0 && tile.side * 2 * view.pxPerM < MIN_SIDE_PX) return;
    const apart = tile.x > view.maxX || tile.x + tile.side < view.minX ||
        tile.y > view.maxY || tile.y + tile.side < view.minY;
    if (!apart) chosen.push(i);
  });
  return chosen.sort((a, b) => tiles[a].level - tiles[b].level);
}

/** Fetches squares as views ask for them, a few at a time, and keeps those used last. */
export class TileStore {
  private readonly rows = new Map<number, Rows>();
  private wanted: number[] = [];
  private readonly underWay = new Set<number>();
  private static readonly MAX_KEPT = 600;
  private static readonly MAX_AT_ONCE = 6;

  constructor(private readonly api: Api, private readonly base: string, readonly list: TileList,
              private readonly arrived: () => void, private readonly failed: (e: Error) => void) {}

  /** Those of the numbers that are here; the others are on their way. */
  want(numbers: number[]): { tile: number; rows: Rows }[] {
    this.wanted = numbers;
    const here: { tile: number; rows: Rows }[] = [];
    for (const tile of numbers) {
      const rows = this.rows.get(tile);
      if (!rows) continue;
      this.rows.delete(tile);  // the last in a Map is the newest
      this.rows.set(tile, rows);
      here.push({ tile, rows });
    }
    this.fetchMore();
    return here;
  }

  get isComplete(): boolean { return this.wanted.every((tile) => this.rows.has(tile)); }

  private fetchMore(): void {
    for (const tile of this.wanted) {
      if (this.underWay.size >= TileStore.MAX_AT_ONCE) return;
      if (this.rows.has(tile) || this.underWay.has(tile)) continue;
      this.underWay.add(tile);
      void this.fetchOne(tile);
    }
  }

  private async fetchOne(tile: number): Promise<void> {
    try {
      const query = new URLSearchParams({ content_id: this.list.content_id });
      const bytes = await this.api.bytes(`${this.base}/tiles/${tile}?${query}`);
      this.rows.set(tile, decodeRows(bytes));
      for (const oldest of this.rows.keys()) {
        if (this.rows.size <= TileStore.MAX_KEPT) break;
        this.rows.delete(oldest);
      }
      this.arrived();
    } catch (error) {
      this.wanted = this.wanted.filter((other) => other !== tile);
      this.failed(error as Error);
    } finally {
      this.underWay.delete(tile);
      this.fetchMore();
    }
  }
}
