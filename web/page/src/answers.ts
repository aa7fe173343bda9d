// The answers that came, and what they say of robots and places.
import type { Answer, Candidate, MapUse, Outcome, SeenAnswer } from './api.ts';

const MAX_KEPT = 2000;
/** A robot that is farther off, or was silent for longer, begins a new trail. */
const MAX_STEP_M = 100;
const MAX_SILENCE_S = 300;

/** What the server counted may be stamped a little before the answer that it is of. */
const SAME_ANSWER_NS = 1e6;

/** The number of an answer to the page itself; the server's begin with 1. */
export const OWN = 0;

export interface PlaceHealth {
  found: number;
  confidence: number;
  lastNs: number;
  /** Of the server's counts alone: refused queries, and the share of the structure that lately disagreed. */
  refused: number;
  disagreement: number;
}
export interface Trail { client: string; points: [number, number][] }
export interface LostSpot { client: string; x: number; y: number; answer: SeenAnswer }

export function bestOf(answer: Answer): Candidate | undefined { return answer.candidates[0]; }

export class AnswerStore {
  /** Oldest first. */
  readonly all: SeenAnswer[] = [];
  private readonly health = new Map<number, PlaceHealth>();
  private countedUntilNs = -1;
  /** Another one whenever what is known of places may have changed. */
  revision = 0;

  /** Returns the answer that is kept: one to the page itself also comes as one of all, and counts once. */
  add(answer: SeenAnswer): SeenAnswer {
    const same = this.all.find(({ number, request_id }) =>
        request_id === answer.request_id && (number === OWN) !== (answer.number === OWN));
    if (same) return same;
    this.all.push(answer);
    if (this.all.length > MAX_KEPT) this.all.shift();
    this.count(answer);
    return answer;
  }

  /** What the server counted since long, in place of what came here until then. */
  setUse(use: MapUse): void {
    ++this.revision;
    this.countedUntilNs = use.until_ns + SAME_ANSWER_NS;
    this.health.clear();
    for (const place of use.places) {
      this.health.set(place.place, {
        found: place.num_found, confidence: place.confidence * place.num_found, lastNs: place.last_found_ns,
        refused: place.num_refused, disagreement: place.recent_disagreement,
      });
    }
    this.all.forEach((seen) => this.count(seen));
  }

  private count({ answer, answered_ns }: SeenAnswer): void {
    ++this.revision;
    const best = bestOf(answer);
    if (answer.outcome !== 'localized' || !best || answered_ns <= this.countedUntilNs) return;
    const before = this.health.get(best.place) ??
        { found: 0, confidence: 0, lastNs: 0, refused: 0, disagreement: 0 };
    this.health.set(best.place, {
      ...before, found: before.found + 1, confidence: before.confidence + (best.confidence ?? 1), lastNs: answered_ns,
    });
  }

  /** How often the place was found, and with what confidence on the average. */
  healthOf(place: number): PlaceHealth | undefined {
    const sum = this.health.get(place);
    return sum && { ...sum, confidence: sum.found > 0 ? sum.confidence / sum.found : 0 };
  }

  countOf(outcome: Outcome): number {
    return this.all.filter((seen) => seen.answer.outcome === outcome).length;
  }

  trails(): Trail[] {
    const open = new Map<string, { trail: Trail; ns: number }>();
    const done: Trail[] = [];
    for (const { answer, client, answered_ns } of this.all) {
      const best = bestOf(answer);
      if (answer.outcome !== 'localized' || !best) continue;
      const at: [number, number] = [best.T_map_query.x, best.T_map_query.y];
      const last = open.get(client);
      const end = last?.trail.points[last.trail.points.length - 1];
      const goesOn = last && end && Math.hypot(at[0] - end[0], at[1] - end[1]) <= MAX_STEP_M &&
          (answered_ns - last.ns) / 1e9 <= MAX_SILENCE_S;
      if (goesOn) {
        last.trail.points.push(at);
        last.ns = answered_ns;
        continue;
      }
      const trail = { client, points: [at] };
      open.set(client, { trail, ns: answered_ns });
      done.push(trail);
    }
    return done.filter((trail) => trail.points.length > 1);
  }

  /** Where robots were last known to be when they were not recognised. */
  lostSpots(): LostSpot[] {
    const last = new Map<string, [number, number]>();
    const lost: LostSpot[] = [];
    for (const seen of this.all) {
      const best = bestOf(seen.answer);
      if (seen.answer.outcome === 'localized' && best) {
        last.set(seen.client, [best.T_map_query.x, best.T_map_query.y]);
      } else if (seen.answer.outcome !== 'localized') {
        const at = last.get(seen.client);
        if (at) lost.push({ client: seen.client, x: at[0], y: at[1], answer: seen });
      }
    }
    return lost;
  }

  /** Newest first: those whose robot, request, session or place the text names. */
  search(text: string, limit = 200): SeenAnswer[] {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean);
    const found: SeenAnswer[] = [];
    for (let i = this.all.length - 1; i >= 0 && found.length < limit; --i) {
      const seen = this.all[i];
      const best = bestOf(seen.answer);
      const said = [seen.client, seen.request_id, seen.answer.outcome.replace('_', ' '),
        best?.session ?? '', best ? `place ${best.place}` : ''].join(' ').toLowerCase();
      if (words.every((word) => said.includes(word))) found.push(seen);
    }
    return found;
  }
}

/** "place 12" or "12": the place that is asked for, if there is such a one. */
export function placeNamed(text: string, numPlaces: number): number | null {
  const match = /^\s*(?:place\s*)?#?(\d{1,9})\s*$/i.exec(text);
  if (!match) return null;
  const place = Number(match[1]);
  return place < numPlaces ? place : null;
}
