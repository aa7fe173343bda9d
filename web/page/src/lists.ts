// The lists of the panel, and what is said of a thing in a few words.
import type { MapInfo, Pair } from './api.ts';
import { type AnswerStore, bestOf, placeNamed } from './answers.ts';
import { outcomeMark } from './detail.ts';
import { make, percent } from './dom.ts';
import { swatch } from './legend.ts';
import type { Picked } from './picking.ts';
import { OUTCOMES, sessionColour } from './palette.ts';

export interface Shown {
  info: MapInfo;
  answers: AnswerStore;
  pairs: Pair[];
  chosen: Picked | null;
  dark: boolean;
  /** What is searched for; may be empty. */
  query: string;
  /** Why answers do not come; empty if they do. */
  trouble: string;
  choose: (picked: Picked) => void;
  showSessions: () => void;
}

const MAX_PAIRS = 200;

export function textOf(picked: Picked, answers: AnswerStore): string {
  if (picked.kind === 'place') {
    const health = answers.healthOf(picked.place);
    return `place ${picked.place}${health?.found ? `, found ${health.found} times` : ''}`;
  }
  if (picked.kind === 'pair') return `places ${picked.pair.place} and ${picked.pair.lookalike} look alike`;
  const best = bestOf(picked.answer.answer);
  return `${OUTCOMES[picked.answer.answer.outcome].name}, ${percent(best?.confidence)}, ${picked.answer.client}`;
}

/** The place and the sessions that are meant, then the answers. */
export function answerRows({ info, answers, chosen, dark, query, trouble, choose, showSessions }: Shown): HTMLElement[] {
  const place = placeNamed(query, info.num_places);
  const rows: HTMLElement[] = place === null ? [] : [make('button', {
    type: 'button', click: () => choose({ kind: 'place', place }),
  }, make('span', {}, '◎'), `Place ${place} of the map`)];
  const words = query.trim().toLowerCase();
  info.sessions.forEach((session, i) => {
    if (!words || !session.toLowerCase().includes(words)) return;
    rows.push(make('button', { type: 'button', click: showSessions }, swatch(sessionColour(i)), `Session ${session}`));
  });
  for (const seen of answers.search(query)) {
    const best = bestOf(seen.answer);
    const name = OUTCOMES[seen.answer.outcome].name;
    rows.push(make('button', {
      type: 'button', click: () => choose({ kind: 'answer', answer: seen }),
      'aria-current': String(chosen?.kind === 'answer' && chosen.answer === seen),
    }, outcomeMark(seen.answer.outcome, dark), make('span', {}, best ? `${name}, place ${best.place}` : name),
    make('span', {}, percent(best?.confidence)),
    make('small', {}, `${seen.client} · ${seen.request_id} · ${new Date(seen.answered_ns / 1e6).toLocaleTimeString()}`)));
  }
  if (rows.length > 0) return rows;
  return [make('p', {}, words ? 'Nothing that was answered here says so.' :
      trouble || 'No answers yet. They appear as robots ask; or drop a scan file on the page.')];
}

export function pairRows({ pairs, chosen, dark, choose }: Shown): HTMLElement[] {
  if (pairs.length === 0) return [make('p', {}, 'No two places far from each other were found to look alike.')];
  return pairs.slice(0, MAX_PAIRS).map((pair) => make('button', {
    type: 'button', click: () => choose({ kind: 'pair', pair }),
    'aria-current': String(chosen?.kind === 'pair' && chosen.pair === pair),
  }, outcomeMark('ambiguous', dark), make('span', {}, `Places ${pair.place} and ${pair.lookalike}`),
  make('span', {}, percent(pair.confidence)),
  make('small', {}, `${Math.hypot(pair.from.x - pair.to.x, pair.from.y - pair.to.y).toFixed(0)} m apart`)));
}
