import { Api, type MapInfo, type MapSummary, type MapUse, type Pair, type PlaceDetails, type SeenAnswer, type Snapshot,
  type TileList } from './api.ts';
import { AnswerStore, bestOf, OWN } from './answers.ts';
import { answerDetail, type DetailContext, pairDetail, placeDetail } from './detail.ts';
import { byId, make } from './dom.ts';
import { legendOf } from './legend.ts';
import { answerRows, pairRows, textOf } from './lists.ts';
import { type Look, MapView } from './map_view.ts';
import type { ColourBy } from './palette.ts';
import { buildOptions } from './options.ts';
import type { Picked } from './picking.ts';
import { scaleFor } from './scale.ts';
import { TileStore } from './tiles.ts';

const snapshot = JSON.parse(byId('snapshot').textContent || 'null') as Snapshot | null;
const api = new Api(snapshot);
api.token = snapshot ? '' : sessionStorage.getItem('scanloc-token') ?? '';

type Tab = 'answers' | 'pairs';
const prefersDark = matchMedia('(prefers-color-scheme: dark)');
const look: Look = {
  dark: prefersDark.matches, colourBy: 'session', heights: null, showTrails: true, showPairs: false,
};
let info: MapInfo | null = null;
let list: TileList | null = null;
let answers = new AnswerStore();
let pairs: Pair[] = [];
let tab: Tab = 'answers';
let watching = new AbortController();
let trouble = '';
const places = new Map<number, Promise<PlaceDetails>>();
const MAX_PLACES = 300;

const map = new MapView(byId<HTMLDivElement>('map'), look, {
  pick: (picked) => choose(picked, false),
  hover: showTip,
  moved: showScale,
  near: (near) => void fetchStructures(near),
});

function say(text: string): void {
  byId('status').textContent = text;
  byId('status').title = text;
}

function sayState(): void {
  if (!info) return;
  const live = trouble || (snapshot ? 'a snapshot' : 'live');
  say(`${info.num_places.toLocaleString('en')} places, ${answers.all.length.toLocaleString('en')} answers (${live})`);
}

const base = () => `/v1/maps/${encodeURIComponent(info!.name)}`;

function placeOf(place: number): Promise<PlaceDetails> {
  let told = places.get(place);
  if (!told) {
    told = api.json<PlaceDetails>(`${base()}/places/${place}`);
    places.set(place, told);
    told.catch(() => places.delete(place));
    if (places.size > MAX_PLACES) places.delete(places.keys().next().value!);
  }
  return told;
}

async function fetchStructures(near: number[]): Promise<void> {
  const told = await Promise.allSettled(near.map(placeOf));
  for (const one of told) if (one.status === 'fulfilled') map.structures.set(one.value.place, one.value);
  while (map.structures.size > MAX_PLACES) map.structures.delete(map.structures.keys().next().value!);
  map.redraw();
}

async function openMap(name: string): Promise<void> {
  watching.abort();
  watching = new AbortController();
  info = null;
  say(`loading ${name} …`);
  const path = `/v1/maps/${encodeURIComponent(name)}`;
  const told = await api.json<MapInfo>(path);
  list = await api.json<TileList>(`${path}/tiles`);
  info = told;
  answers = new AnswerStore();
  places.clear();
  look.heights = null;
  map.answers = answers;
  map.chosen = null;
  const extent = told.extent ?? { min: { x: 0, y: 0, z: 0 }, max: { x: 1, y: 1, z: 1 } };
  const tell = (wrong: string) => { trouble = wrong; showList(); sayState(); };
  map.setMap(new TileStore(api, path, list, () => map.redraw(), (error) => tell(error.message)), {
    width: extent.max.x - extent.min.x, height: extent.max.y - extent.min.y, depth: extent.max.z - extent.min.z,
  });
  closeDetail();
  showLegend();
  sayState();
  pairs = (await api.json<{ pairs: Pair[] }>(`${path}/pairs`).catch(() => ({ pairs: [] }))).pairs;
  map.pairs = pairs;
  const use = await api.json<MapUse>(`${path}/use`).catch(() => null);  // not counted, or not for us
  if (use) answers.setUse(use);
  refresh();
  if (snapshot) {
    const kept = await api.json<{ answers: SeenAnswer[] }>('/v1/answers');
    kept.answers.filter((seen) => seen.answer.map === name).forEach((seen) => answers.add(seen));
    return refresh();
  }
  void api.watch(name, watching.signal, take, (error) => tell(error ? `not live: ${error.message}` : ''));
}

let refreshing = 0;
/** Answers may come by the hundred: what they change is drawn once a frame. */
function take(seen: SeenAnswer): void {
  answers.add(seen);
  refreshing ||= requestAnimationFrame(() => { refreshing = 0; refresh(); });
}

function refresh(): void {
  map.redraw();
  showList();
  showLegend();
  sayState();
}

// --- what is chosen

function contextOf(): DetailContext {
  return {
    api, info: info!, answers, dark: look.dark, placeOf, close: closeDetail,
    goTo: (x, y) => map.goTo(x, y),
    goToPlace: (place) => choose({ kind: 'place', place }, true),
  };
}

function closeDetail(): void {
  byId('detail').hidden = true;
  map.chosen = null;
  refresh();
}

async function choose(picked: Picked | null, move: boolean): Promise<void> {
  if (!info || !picked) return;
  map.chosen = picked;
  const detail = byId('detail');
  let box: HTMLElement;
  try {
    if (picked.kind === 'place') {
      const told = await placeOf(picked.place);
      map.structures.set(picked.place, told);
      box = placeDetail(contextOf(), told);
      if (move) map.goTo(told.T_map_place.x, told.T_map_place.y);
    } else if (picked.kind === 'answer') {
      box = answerDetail(contextOf(), picked.answer);
      const best = bestOf(picked.answer.answer);
      if (move && best) map.goTo(best.T_map_query.x, best.T_map_query.y, 1);
    } else {
      look.showPairs = true;
      box = pairDetail(contextOf(), picked.pair);
      if (move) map.showAll();
    }
  } catch (error) {
    return say((error as Error).message);
  }
  detail.replaceChildren(box);
  detail.hidden = false;
  byId('panel').scrollTop = 0;
  refresh();
}

// --- lists

function showTip(picked: Picked | null, x: number, y: number): void {
  const tip = byId('tip');
  tip.hidden = !picked;
  if (!picked) return;
  tip.textContent = textOf(picked, answers);
  tip.style.left = `${Math.min(x + 14, map.size.width - 190)}px`;
  tip.style.top = `${Math.max(y - 30, 4)}px`;
}

function found(): SeenAnswer[] { return answers.search(byId<HTMLInputElement>('search').value); }

function showList(): void {
  if (!info) return;
  byId('tabs').replaceChildren(...(['answers', 'pairs'] as const).map((name) => make('button', {
    type: 'button', role: 'tab', 'aria-selected': String(name === tab), id: `tab-${name}`,
    click: () => { tab = name; look.showPairs = name === 'pairs' || look.showPairs; refresh(); },
  }, name === 'answers' ? 'Answers' : `Look-alikes (${pairs.length})`)));
  const shown = {
    info, answers, pairs, chosen: map.chosen, dark: look.dark, query: byId<HTMLInputElement>('search').value,
    trouble,
    choose: (picked: Picked) => void choose(picked, true), showSessions: () => setColourBy('session'),
  };
  byId('list').replaceChildren(...(tab === 'answers' ? answerRows(shown) : pairRows(shown)));
}

// --- legend and look

function showLegend(): void {
  if (info) byId('legend').replaceChildren(...legendOf(info, look, answers));
}

function showScale(): void {
  const bar = byId('scale-bar').firstElementChild as HTMLElement;
  const { metres, text } = scaleFor(map.pxPerM);
  bar.style.width = `${metres * map.pxPerM}px`;
  bar.textContent = text;
}

function setColourBy(by: ColourBy): void {
  look.colourBy = by;
  showLegend();
  showOptions();
  map.redraw();
}

function setDark(dark: boolean): void {
  look.dark = dark;
  document.documentElement.dataset.theme = dark ? 'dark' : 'light';
  if (!info) return;
  showLegend();
  showOptions();
  if (map.chosen) void choose(map.chosen, false);
  refresh();
}

function showOptions(): void {
  if (!info || !list) return;
  buildOptions(byId('options'), {
    look, floors: list.floors, originZ: list.origin.z, token: snapshot ? null : api.token,
    setColourBy, setDark,
    setHeights: (heights) => { look.heights = heights; map.redraw(); },
    setShown: (what, on) => { look[what] = on; map.redraw(); },
    setToken: (token) => {
      api.token = token;
      sessionStorage.setItem('scanloc-token', token);
      void start();
    },
  });
}

function toggleOptions(): void {
  const options = byId('options');
  options.hidden = !options.hidden;
  byId('settings').setAttribute('aria-expanded', String(!options.hidden));
  showOptions();
}

// --- a scan of one's own

let numAsked = 0;
async function locate(file: File): Promise<void> {
  if (!info) return;
  const requestId = `page-${Date.now().toString(36)}-${++numAsked}`;
  say(`asking where ${file.name} was taken …`);
  try {
    const answer = await api.localize(info.name, file, requestId);
    const seen: SeenAnswer = {
      number: OWN, answered_ns: Date.now() * 1e6, request_id: requestId, client: file.name, is_of_stream: false,
      answer, posts_cm: answer.posts_cm ?? [],
    };
    const kept = answers.add(seen);
    sayState();
    await choose({ kind: 'answer', answer: kept }, true);
  } catch (error) {
    say(`${file.name}: ${(error as Error).message}`);
  }
}

// --- keys, files, start

function step(by: number): void {
  const shown = found();
  const at = map.chosen?.kind === 'answer' ? shown.indexOf(map.chosen.answer) : -1;
  const next = shown[Math.min(Math.max(at + by, 0), shown.length - 1)];
  if (next) void choose({ kind: 'answer', answer: next }, true);
}

const KEYS: Record<string, () => void> = {
  '/': () => byId('search').focus(),
  f: () => map.showAll(),
  n: () => step(1),
  p: () => step(-1),
  d: () => setDark(!look.dark),
  c: () => setColourBy((['session', 'height', 'age', 'found'] as const)[
      (['session', 'height', 'age', 'found'].indexOf(look.colourBy) + 1) % 4]),
  l: () => byId('open-scan').click(),
  s: toggleOptions,
};

document.addEventListener('keydown', (event) => {
  if (event.key === 'Escape') return closeDetail();
  const typing = event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement;
  if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
  const act = KEYS[event.key.toLowerCase()];
  if (!act) return;
  event.preventDefault();
  act();
});
byId('search').addEventListener('input', showList);
byId('search').addEventListener('keydown', (event) => {
  if (event.key === 'Enter') byId('list').querySelector('button')?.click();
});
byId('settings').addEventListener('click', toggleOptions);
byId('open-scan').addEventListener('click', () => byId('scan-file').click());
byId<HTMLInputElement>('scan-file').addEventListener('change', (event) => {
  const input = event.target as HTMLInputElement;
  if (input.files?.[0]) void locate(input.files[0]);
  input.value = '';
});
for (const name of ['dragenter', 'dragover'] as const) {
  document.addEventListener(name, (event) => { event.preventDefault(); byId('drop').hidden = false; });
}
document.addEventListener('dragleave', (event) => { if (!event.relatedTarget) byId('drop').hidden = true; });
document.addEventListener('drop', (event) => {
  event.preventDefault();
  byId('drop').hidden = true;
  const file = event.dataTransfer?.files[0];
  if (file) void locate(file);
});
prefersDark.addEventListener('change', () => setDark(prefersDark.matches));
byId<HTMLSelectElement>('map-choice').addEventListener('change', (event) => {
  void openMap((event.target as HTMLSelectElement).value).catch((error: Error) => say(error.message));
});

async function start(): Promise<void> {
  try {
    const names = snapshot ? [snapshot.map] :
        (await api.json<{ maps: MapSummary[] }>('/v1/maps')).maps.filter(({ state }) => state === 'serving')
            .map(({ name }) => name);
    byId('map-choice').replaceChildren(...names.map((name) => make('option', { value: name }, name)));
    if (names.length === 0) return say('the server has no map to show yet');
    const asked = new URLSearchParams(location.search).get('map');
    const first = asked && names.includes(asked) ? asked : names[0];
    byId<HTMLSelectElement>('map-choice').value = first;
    await openMap(first);
  } catch (error) {
    say((error as Error).message);
    byId('options').hidden = false;
    buildOptions(byId('options'), null, (token) => {
      api.token = token;
      sessionStorage.setItem('scanloc-token', token);
      void start();
    });
  }
}

// For tests, and whoever wants to look from the console.
Object.assign(window, { scanloc: { map, locate, answers: () => answers, isComplete: () => map.isComplete } });
setDark(prefersDark.matches);
if (snapshot) byId('open-scan').hidden = true;
void start();
