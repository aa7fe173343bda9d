// What the marks and colours of the map mean.
import type { MapInfo } from './api.ts';
import type { AnswerStore } from './answers.ts';
import { outcomeMark } from './detail.ts';
import { make, svg } from './dom.ts';
import type { Look } from './map_view.ts';
import { markSvg, OUTCOMES, sessionColour } from './palette.ts';

const MAX_SESSIONS = 8;

export function swatch(colour: readonly number[]): Element {
  return svg('<svg xmlns="http://www.w3.org/2000/svg" width="12" height="12">' +
      `<circle cx="6" cy="6" r="5" fill="rgb(${colour.join()})"/></svg>`);
}

export function legendOf(info: MapInfo, look: Look, answers: AnswerStore): Node[] {
  const parts: Node[] = (Object.keys(OUTCOMES) as (keyof typeof OUTCOMES)[])
      .map((outcome) => make('span', {}, outcomeMark(outcome, look.dark),
          `${OUTCOMES[outcome].name}: ${answers.countOf(outcome).toLocaleString('en')}`));
  const { light, dark } = OUTCOMES.not_recognized;
  parts.push(make('span', {}, svg(markSvg('ring', look.dark ? dark : light, '', 14)),
      'last seen before a robot was lost'));
  if (look.colourBy === 'session') {
    info.sessions.slice(0, MAX_SESSIONS).forEach((name, i) =>
        parts.push(make('span', {}, swatch(sessionColour(i)), name)));
    const more = info.sessions.length - MAX_SESSIONS;
    if (more > 0) parts.push(make('span', {}, `and ${more} more sessions`));
    return parts;
  }
  const meaning = {
    height: 'places: dark low, light high', age: 'places: dark old, light new; grey without a time',
    found: 'places: light found with confidence, grey never found',
  }[look.colourBy];
  parts.push(make('span', {}, meaning));
  return parts;
}
