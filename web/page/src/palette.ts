// Colours that colour-blind people can tell apart (Okabe and Ito's), and marks beside them.
import type { Outcome } from './api.ts';

export type Mark = 'disc' | 'triangle' | 'cross' | 'square' | 'ring';
export type Rgb = [number, number, number];
export type ColourBy = 'session' | 'height' | 'age' | 'found';

const hex = (text: string): Rgb =>
    [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16)) as Rgb;

/** None of an outcome's. */
const SESSIONS = ['#009e73', '#cc79a7', '#7a6fb0', '#8c8c8c', '#b8a100', '#4fb3a9', '#a0705a', '#5f8f3a']
    .map(hex);

export const OUTCOMES: Record<Outcome, { name: string; light: string; dark: string; mark: Mark }> = {
  localized: { name: 'localized', light: '#0072b2', dark: '#56b4e9', mark: 'disc' },
  ambiguous: { name: 'ambiguous', light: '#b87a00', dark: '#f0b429', mark: 'triangle' },
  not_recognized: { name: 'not recognised', light: '#c8460a', dark: '#ff7f4d', mark: 'cross' },
  insufficient_scan: { name: 'insufficient scan', light: '#5d6670', dark: '#aab4c0', mark: 'square' },
};

export function outcomeColour(outcome: Outcome, dark: boolean): Rgb {
  return hex(dark ? OUTCOMES[outcome].dark : OUTCOMES[outcome].light);
}

export function sessionColour(session: number): Rgb { return SESSIONS[session % SESSIONS.length]; }

/** Cividis: as light as it is high, and the same to everybody. t in [0, 1]. */
export function ramp(t: number): Rgb {
  const stops: Rgb[] = ['#00224e', '#35456c', '#666970', '#948e77', '#c8b866', '#fee838'].map(hex);
  const at = Math.min(Math.max(t, 0), 1) * (stops.length - 1);
  const low = Math.min(Math.floor(at), stops.length - 2);
  return stops[low].map((v, i) => Math.round(v + (stops[low + 1][i] - v) * (at - low))) as Rgb;
}

/** A mark of 32 x 32 as SVG. */
export function markSvg(mark: Mark, colour: string, edge: string, size = 32): string {
  const shapes: Record<Mark, string> = {
    disc: `<circle cx="16" cy="16" r="11" fill="${colour}" stroke="${edge}" stroke-width="2.5"/>`,
    triangle: `<path d="M16 4 L29 27 L3 27 Z" fill="${colour}" stroke="${edge}" stroke-width="2.5"/>`,
    cross: `<path d="M7 7 L25 25 M25 7 L7 25" stroke="${edge}" stroke-width="10" stroke-linecap="round"/>` +
        `<path d="M7 7 L25 25 M25 7 L7 25" stroke="${colour}" stroke-width="6" stroke-linecap="round"/>`,
    square: `<rect x="6" y="6" width="20" height="20" fill="${edge}" stroke="${colour}" stroke-width="5"/>`,
    ring: `<circle cx="16" cy="16" r="12" fill="none" stroke="${colour}" stroke-width="4"/>`,
  };
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${size}" height="${size}" viewBox="0 0 32 32">${shapes[mark]}</svg>`;
}
