// The map from above: places, answers, trails and pairs, drawn by deck.gl.
import { Deck, OrthographicView, type Layer, type PickingInfo } from '@deck.gl/core';
import { PathLayer, TextLayer } from '@deck.gl/layers';
import type { Pair, PlaceDetails, Point, SeenAnswer } from './api.ts';
import { bestOf, type AnswerStore } from './answers.ts';
import { arc, nameRivals, postsInMap } from './geometry.ts';
import { type ColourBy, OUTCOMES, outcomeColour, ramp, type Rgb, sessionColour } from './palette.ts';
import { pickAt, type Picked, spotsOf } from './picking.ts';
import { Points, PointsLayer } from './points_layer.ts';
import { chooseTiles, type Rows, type TileStore, type View } from './tiles.ts';

export interface Look {
  dark: boolean;
  colourBy: ColourBy;
  /** Heights to show [m from the origin]; null: all. */
  heights: [number, number] | null;
  showTrails: boolean;
  showPairs: boolean;
}

interface Events {
  pick: (picked: Picked | null) => void;
  hover: (picked: Picked | null, x: number, y: number) => void;
  moved: () => void;
  /** Of the places shown when little else is: for their structure. */
  near: (places: number[]) => void;
}

const NEAR_PX_PER_M = 3;  // from here on single places can be told apart
const MAX_NEAR = 12;
const MAX_ANSWERS = 1000;
const MAX_PAIRS = 400;
const LEGEND_PX = 100;  // less on a phone, where it scrolls
const PHONE_PX = 720;
const FALLBACK_SIZE = 600;

export class MapView {
  look: Look;
  answers: AnswerStore | null = null;
  pairs: Pair[] = [];
  chosen: Picked | null = null;
  structures = new Map<number, PlaceDetails>();
  isComplete = false;
  /** The first and the last stamp [s from the first]. */
  private maxStamp = 1;
  private readonly deck: Deck<OrthographicView>;
  private tiles: TileStore | null = null;
  private extent = { width: 100, height: 100, depth: 1 };
  private state = { target: [0, 0, 0] as [number, number, number], zoom: 0, minZoom: -14, maxZoom: 8 };
  /** What deck.gl is given of a square: the same object while nothing changes, or it is sent anew. */
  private points = new WeakMap<Rows, { key: string; points: Points }>();
  private here: { tile: number; rows: Rows }[] = [];
  private isOver = false;
  private drawn = '';
  private nearShown = '';
  private origin: Point = { x: 0, y: 0, z: 0 };

  constructor(private readonly parent: HTMLDivElement, look: Look, private readonly events: Events) {
    this.look = look;
    this.deck = new Deck({
      parent,
      views: new OrthographicView({ id: 'above', flipY: false }),
      controller: { scrollZoom: { speed: 0.01, smooth: false }, doubleClickZoom: true, keyboard: true, inertia: 0 },
      viewState: this.state,
      deviceProps: { type: 'webgl', webgl: { antialias: false, preserveDrawingBuffer: false } } as never,
      useDevicePixels: Math.min(window.devicePixelRatio || 1, 2),
      onViewStateChange: ({ viewState }) => this.move(viewState as typeof this.state),
      onClick: ({ x, y }: PickingInfo) => this.events.pick(this.pick(x, y)),
      onHover: ({ x, y }: PickingInfo) => this.hover(x, y),
      onResize: () => this.redraw(),
      getCursor: ({ isDragging }) => isDragging ? 'grabbing' : this.isOver ? 'pointer' : 'grab',
      layers: [],
    });
  }

  setMap(tiles: TileStore, extent: { width: number; height: number; depth: number }): void {
    this.tiles = tiles;
    this.origin = tiles.list.origin;
    this.extent = extent;
    this.structures.clear();
    this.pairs = [];
    this.maxStamp = 1;
    this.showAll();
  }

  get size(): { width: number; height: number } {
    return { width: this.parent.clientWidth || FALLBACK_SIZE, height: this.parent.clientHeight || FALLBACK_SIZE };
  }

  get pxPerM(): number { return 2 ** this.state.zoom; }

  get numDrawn(): number { return this.here.reduce((sum, { rows }) => sum + rows.count, 0); }

  showAll(): void {
    const { width, height } = this.size;
    const free = Math.max(height - (window.innerWidth > PHONE_PX ? LEGEND_PX : 64), height / 2);  // above the legend
    const fit = Math.min(width / (this.extent.width + 20), free / (this.extent.height + 20)) * 0.92;
    const middle = this.extent.height / 2 - (height - free) / 2 / fit;
    this.move({ ...this.state, target: [this.extent.width / 2, middle, 0], zoom: Math.log2(fit) });
  }

  /** Brings a point of the map into view, and near. */
  goTo(x: number, y: number, leastPxPerM = 4): void {
    this.move({
      ...this.state,
      target: [x - this.origin.x, y - this.origin.y, 0],
      zoom: Math.max(this.state.zoom, Math.log2(leastPxPerM)),
    });
  }

  private hover(x: number, y: number): void {
    const picked = x < 0 ? null : this.pick(x, y);
    this.isOver = picked !== null;
    this.events.hover(picked, x, y);
  }

  private move(state: typeof this.state): void {
    this.state = { ...this.state, target: state.target, zoom: Math.min(Math.max(state.zoom, -14), 8) };
    this.deck.setProps({ viewState: this.state });
    this.redraw(false);
    this.events.moved();
  }

  private view(): View {
    const { width, height } = this.size;
    const halfX = width / 2 / this.pxPerM;
    const halfY = height / 2 / this.pxPerM;
    const [x, y] = this.state.target;
    return { minX: x - halfX, maxX: x + halfX, minY: y - halfY, maxY: y + halfY, pxPerM: this.pxPerM };
  }

  /** Draws anew what has changed; everything, if something else than the view has. */
  redraw(all = true): void {
    if (!this.tiles) return;
    const view = this.view();
    const numbers = chooseTiles(this.tiles.list.tiles, view);
    const here = this.tiles.want(numbers);
    this.here = here;
    this.isComplete = this.tiles.isComplete;
    for (const { rows } of here) this.maxStamp = Math.max(this.maxStamp, rows.maxStamp);
    this.findNear(here, view);
    // The names of rivals go by how far they are from each other on the screen.
    const named = this.chosen?.kind === 'answer' ? Math.round(4 * this.state.zoom) : 0;
    const key = [here.map(({ tile }) => tile).join(), this.pxPerM > NEAR_PX_PER_M, this.nearShown, named].join(' ');
    if (!all && key === this.drawn) return;
    this.drawn = key;
    this.deck.setProps({ layers: [...here.map(({ tile, rows }) => this.placeLayer(tile, rows)), ...this.upperLayers()] });
  }

  private findNear(here: { rows: Rows }[], view: View): void {
    const near: { place: number; far: number }[] = [];
    if (this.pxPerM > NEAR_PX_PER_M) {
      const [cx, cy] = this.state.target;
      for (const { rows } of here) {
        for (let i = 0; i < rows.count; ++i) {
          const x = rows.position[3 * i];
          const y = rows.position[3 * i + 1];
          if (x < view.minX || x > view.maxX || y < view.minY || y > view.maxY) continue;
          if (!this.isShown(rows, i)) continue;
          near.push({ place: rows.place[i], far: Math.hypot(x - cx, y - cy) });
        }
      }
    }
    near.sort((a, b) => a.far - b.far);
    const places = near.slice(0, MAX_NEAR).map(({ place }) => place);
    const key = places.join();
    if (key === this.nearShown) return;
    this.nearShown = key;
    this.events.near(places);
  }

  private isShown(rows: Rows, i: number): boolean {
    const heights = this.look.heights;
    const z = rows.position[3 * i + 2];
    return !heights || (z >= heights[0] - 0.01 && z <= heights[1] + 0.01);
  }

  private colourOf(rows: Rows, i: number): Rgb {
    switch (this.look.colourBy) {
      case 'session': return sessionColour(rows.session[i]);
      case 'height': return ramp(rows.position[3 * i + 2] / Math.max(this.extent.depth, 0.1));
      case 'age': return rows.stamp[i] === 0 ? [128, 128, 128] : ramp(rows.stamp[i] / this.maxStamp);
      case 'found': {
        const health = this.answers?.healthOf(rows.place[i]);
        return health?.found ? ramp(0.25 + 0.75 * health.confidence) : [150, 150, 150];
      }
    }
  }

  private pointsOf(rows: Rows): Points {
    const found = this.look.colourBy === 'found' ? this.answers?.revision : 0;
    const age = this.look.colourBy === 'age' ? this.maxStamp : 0;
    const key = [this.look.colourBy, this.look.heights, age, found].join();
    const kept = this.points.get(rows);
    if (kept?.key === key) return kept.points;
    const points = new Points(rows.count, rows.position);
    for (let i = 0; i < rows.count; ++i) points.colour(i, this.colourOf(rows, i), this.isShown(rows, i) ? 215 : 0);
    this.points.set(rows, { key, points: points.finish() });
    return points;
  }

  private placeLayer(tile: number, rows: Rows): Layer {
    return new PointsLayer({
      id: `tile-${this.tiles!.list.content_id}-${tile}`,
      data: this.pointsOf(rows).data,
      scale: Math.min(Math.max(0.7 * this.pxPerM, 3.2), 12),
      edge: this.edge,
    });
  }

  private flat(x: number, y: number): [number, number] { return [x - this.origin.x, y - this.origin.y]; }

  private at(x: number, y: number): [number, number, number] {
    return [x - this.origin.x, y - this.origin.y, 0];
  }

  private upperLayers(): Layer[] {
    const layers: Layer[] = [];
    const near = new Set(this.nearShown.split(',').map(Number));
    const structures = [...this.structures].filter(([place]) => near.has(place)).map(([, told]) => told);
    if (this.pxPerM > NEAR_PX_PER_M && structures.length > 0) layers.push(this.structureLayer(structures));
    if (this.look.showPairs && this.pairs.length > 0) layers.push(...this.pairLayers());
    if (this.answers && this.look.showTrails) {
      layers.push(new PathLayer({
        id: 'trails', data: this.answers.trails(), widthUnits: 'pixels', getWidth: 2.5, jointRounded: true,
        getPath: (trail: { points: [number, number][] }) => trail.points.map(([x, y]) => this.at(x, y)),
        getColor: [...outcomeColour('localized', this.look.dark), 170],
        updateTriggers: { getColor: this.look.dark },
      }));
    }
    layers.push(this.markLayer());
    if (this.chosen?.kind === 'answer') layers.push(this.rivalNames(this.chosen.answer));
    return layers;
  }

  private get edge(): Rgb { return this.look.dark ? [20, 23, 27] : [255, 255, 255]; }
  private get ink(): Rgb { return this.look.dark ? [231, 234, 238] : [29, 33, 38]; }

  /** Answers, where robots were lost, and what is chosen. */
  private markLayer(): Layer {
    const shown = (this.answers?.all ?? []).slice(-MAX_ANSWERS).filter(({ answer }) => bestOf(answer));
    const lost = (this.answers?.lostSpots() ?? []).slice(-MAX_ANSWERS);
    const chosen = this.chosenSpots();
    const points = new Points(shown.length + lost.length + chosen.length);
    lost.forEach(({ x, y }, i) => points.set(i, ...this.flat(x, y), 'ring', 22,
                                             outcomeColour('not_recognized', this.look.dark), 200));
    shown.forEach(({ answer }, i) => {
      const best = bestOf(answer)!;
      const [x, y] = this.at(best.T_map_query.x, best.T_map_query.y);
      const sure = best.confidence ?? 0.5;
      points.set(lost.length + i, x, y, OUTCOMES[answer.outcome].mark, 11 + 8 * sure,
                 outcomeColour(answer.outcome, this.look.dark), 120 + 135 * sure);
    });
    chosen.forEach(([x, y], i) => points.set(shown.length + lost.length + i, ...this.flat(x, y), 'ring', 30, this.ink));
    return new PointsLayer({ id: 'marks', data: points.finish().data, scale: 1, edge: this.edge });
  }

  private chosenSpots(): [number, number][] {
    if (this.chosen?.kind === 'place') {
      const place = this.structures.get(this.chosen.place);
      return place ? [[place.T_map_place.x, place.T_map_place.y]] : [];
    }
    if (this.chosen?.kind !== 'answer') return [];
    return this.chosen.answer.answer.candidates.map(({ T_map_query: { x, y } }) => [x, y]);
  }

  private rivalNames(seen: SeenAnswer): Layer {
    const spots = seen.answer.candidates.map(({ T_map_query: { x, y } }) => this.flat(x, y));
    return this.textLayer('rival-names', nameRivals(spots, this.pxPerM).map(({ first, text }) =>
        ({ at: [...spots[first], 0] as [number, number, number], text })));
  }

  private textLayer(id: string, data: { at: [number, number, number]; text: string }[]): Layer {
    type Label = (typeof data)[number];
    return new TextLayer({
      id, data, getText: ({ text }: Label) => text, getPosition: ({ at }: Label) => at, getSize: 12,
      getColor: this.ink, getPixelOffset: [0, -22], fontFamily: 'system-ui, "Liberation Sans", sans-serif',
      background: true, getBackgroundColor: [...this.edge, 150], backgroundPadding: [3, 1],
      updateTriggers: { getColor: this.look.dark, getBackgroundColor: this.look.dark },
    });
  }

  private structureLayer(structures: PlaceDetails[]): Layer {
    const points = new Points(structures.reduce((sum, { posts_cm }) => sum + posts_cm.length / 2, 0));
    const colour: Rgb = this.look.dark ? [150, 160, 172] : [95, 103, 112];
    let next = 0;
    for (const told of structures) {
      const posts = postsInMap(told.posts_cm, told.T_map_place);
      for (let i = 0; i + 1 < posts.length; i += 2) {
        points.set(next++, ...this.flat(posts[i], posts[i + 1]), 'disc', 1, colour, 190);
      }
    }
    return new PointsLayer({ id: 'structure', data: points.finish().data, scale: 3, edge: this.edge });
  }

  private pairLayers(): Layer[] {
    const chosen = this.chosen?.kind === 'pair' ? this.chosen.pair : null;
    const colour = outcomeColour('ambiguous', this.look.dark);
    const labels = (chosen ? [chosen] : this.pairs.slice(0, 4)).flatMap(({ place, lookalike, from, to }) => [
      { at: this.at(from.x, from.y), text: `place ${place}` }, { at: this.at(to.x, to.y), text: `place ${lookalike}` }]);
    return [
      new PathLayer({
        id: 'pairs', data: this.pairs.slice(0, MAX_PAIRS), widthUnits: 'pixels', jointRounded: true,
        getPath: (pair: Pair) => this.pathOf(pair).map(([x, y]) => [x, y, 0] as [number, number, number]),
        getWidth: (pair: Pair) => pair === chosen ? 4 : 1 + 2 * pair.confidence,
        getColor: (pair: Pair) => [...colour, pair === chosen ? 255 : 130] as [number, number, number, number],
        updateTriggers: { getWidth: chosen, getColor: [chosen, this.look.dark] },
      }),
      this.textLayer('pair-names', labels),
    ];
  }

  /** What is nearest to the pixel, the upper things first. Looked for here: to have the GPU find it
   *  costs a further drawing of everything. */
  pick(x: number, y: number): Picked | null {
    const { width, height } = this.size;
    const [cx, cy] = this.state.target;
    const at: [number, number] = [cx + (x - width / 2) / this.pxPerM, cy - (y - height / 2) / this.pxPerM];
    const spots = (this.answers ? [...this.answers.lostSpots(), ...spotsOf(this.answers.all.slice(-MAX_ANSWERS))] : [])
        .map(({ x, y, answer }) => ({ x: x - this.origin.x, y: y - this.origin.y, answer }));
    const paths = this.look.showPairs ?
        this.pairs.slice(0, MAX_PAIRS).map((pair) => ({ pair, path: this.pathOf(pair) })) : [];
    const squares = this.here.map(({ tile, rows }) => ({ square: this.tiles!.list.tiles[tile], rows }));
    return pickAt(at, this.pxPerM, spots, paths, squares, (rows, i) => this.isShown(rows, i));
  }

  private pathOf(pair: Pair): [number, number][] {
    const [from, to] = [this.at(pair.from.x, pair.from.y), this.at(pair.to.x, pair.to.y)];
    return arc([from[0], from[1]], [to[0], to[1]]);
  }
}
