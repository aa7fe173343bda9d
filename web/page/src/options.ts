// The settings of the page.
import { make } from './dom.ts';
import type { Look } from './map_view.ts';
import type { ColourBy } from './palette.ts';

interface Settings {
  look: Look;
  floors: { min_z_m: number; max_z_m: number; count: number }[];
  originZ: number;
  /** null: there is nobody to show it to. */
  token: string | null;
  setColourBy: (by: ColourBy) => void;
  setDark: (dark: boolean) => void;
  setHeights: (heights: [number, number] | null) => void;
  setShown: (what: 'showTrails' | 'showPairs', on: boolean) => void;
  setToken: (token: string) => void;
}

const COLOURS: Record<ColourBy, string> = {
  session: 'session', height: 'height', age: 'age', found: 'how surely they are found',
};

function labelled(id: string, text: string, field: HTMLElement): HTMLElement[] {
  field.id = id;
  return [make('label', { for: id }, text), field];
}

function choice(entries: [string, string][], now: string, set: (value: string) => void): HTMLElement {
  const select = make('select', { change: () => set(select.value) },
      ...entries.map(([value, text]) => make('option', { value, selected: value === now }, text)));
  return select;
}

function box(on: boolean, set: (on: boolean) => void): HTMLElement {
  const input = make('input', { type: 'checkbox', checked: on, change: () => set(input.checked) });
  return input;
}

function tokenField(token: string, set: (token: string) => void): HTMLElement[] {
  const input = make('input', { type: 'password', value: token, autocomplete: 'off', change: () => set(input.value) });
  return labelled('token', 'Token', input);
}

function keys(): HTMLElement {
  const entries: [string, string][] = [['/', 'search'], ['N', 'next answer'], ['P', 'previous'], ['F', 'show all'],
    ['+ −', 'zoom'], ['arrows', 'move'], ['C', 'colours'], ['D', 'dark'], ['L', 'locate a scan'], ['S', 'settings'], ['Esc', 'close']];
  return make('p', { class: 'keys' }, 'Keys: ',
      ...entries.flatMap(([key, what]) => [make('kbd', {}, key), ` ${what}  `]));
}

export function buildOptions(parent: HTMLElement, settings: Settings | null,
                             setToken?: (token: string) => void): void {
  if (!settings) return parent.replaceChildren(...tokenField('', setToken!));
  const { look, floors, originZ } = settings;
  const nodes = [
    ...labelled('colour-by', 'Colour places by', choice(Object.entries(COLOURS), look.colourBy,
        (by) => settings.setColourBy(by as ColourBy))),
    ...labelled('theme', 'Dark', box(look.dark, settings.setDark)),
    ...labelled('trails', 'Trails', box(look.showTrails, (on) => settings.setShown('showTrails', on))),
    ...labelled('pairs', 'Look-alikes', box(look.showPairs, (on) => settings.setShown('showPairs', on))),
  ];
  if (floors.length > 1) {
    const now = floors.findIndex((floor) => look.heights && Math.abs(floor.min_z_m - originZ - look.heights[0]) < 0.01);
    nodes.push(...labelled('floor', 'Floor', choice([['-1', 'all'], ...floors.map((floor, i) =>
        [String(i), `${floor.min_z_m.toFixed(1)} to ${floor.max_z_m.toFixed(1)} m (${floor.count} places)`] as [string, string])],
    String(now), (value) => {
      const floor = floors[Number(value)];
      settings.setHeights(floor ? [floor.min_z_m - originZ, floor.max_z_m - originZ] : null);
    })));
  }
  if (settings.token !== null) nodes.push(...tokenField(settings.token, settings.setToken));
  parent.replaceChildren(...nodes, keys());
}
