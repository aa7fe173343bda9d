import assert from 'node:assert/strict';
import { test } from 'node:test';
import { agreement, arc, nameRivals, postsInMap, yawOf } from '../src/geometry.ts';
import { OUTCOMES, ramp } from '../src/palette.ts';

const left = { x: 10, y: 20, z: 0, qx: 0, qy: 0, qz: Math.SQRT1_2, qw: Math.SQRT1_2 };

test('a scan is turned and shifted as its pose says', () => {
  assert.ok(Math.abs(yawOf(left) - Math.PI / 2) < 1e-9);
  const placed = postsInMap([100, 0, 0, 200], left);
  [10, 21, 8, 20].forEach((value, i) => assert.ok(Math.abs(placed[i] - value) < 1e-5));
});

test('posts agree with those that are near, across the cells of the search', () => {
  const place = new Float32Array([0.99, 0.99, 5, 5]);
  assert.deepEqual(agreement(new Float32Array([1.01, 1.01, 5, 6.5, 5.2, 5]), place, 1), [true, false, true]);
});

test('rivals that are too near to each other on the screen share a name', () => {
  const spots: [number, number][] = [[0, 0], [10, 0], [0.5, 0.5], [10, 1], [-20, 4]];
  assert.deepEqual(nameRivals(spots, 10), [
    { first: 0, text: 'best, rival 2' }, { first: 1, text: 'rivals 1, 3' }, { first: 4, text: 'rival 4' }]);
  assert.deepEqual(nameRivals(spots, 1000).map(({ text }) => text), ['best', 'rival 1', 'rival 2', 'rival 3', 'rival 4']);
  assert.deepEqual(nameRivals([], 10), []);
});

test('an arc ends where it should', () => {
  const points = arc([0, 0], [10, 0]);
  assert.deepEqual(points[0], [0, 0]);
  assert.deepEqual(points[points.length - 1], [10, 0]);
});

test('colours go from dark to light, and every outcome has a mark of its own', () => {
  const lightness = [0, 0.5, 1].map((t) => ramp(t).reduce((a, b) => a + b));
  assert.ok(lightness[0] < lightness[1] && lightness[1] < lightness[2]);
  assert.equal(new Set(Object.values(OUTCOMES).map(({ mark }) => mark)).size, 4);
});
