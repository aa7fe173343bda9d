import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { Api, TileList, TileSquare } from '../src/api.ts';
import { chooseTiles, decodeRows, TileStore } from '../src/tiles.ts';

const SQUARES: TileSquare[] = [
  { level: 0, x: 0, y: 0, side: 1000, count: 10 },
  { level: 1, x: 0, y: 0, side: 500, count: 10 },
  { level: 2, x: 0, y: 0, side: 250, count: 10 },
  { level: 1, x: 500, y: 500, side: 500, count: 10 },
  { level: 2, x: 750, y: 750, side: 250, count: 0 },
];

test('rows say what was written', () => {
  const bytes = new ArrayBuffer(48);
  const view = new DataView(bytes);
  view.setUint32(24, 70000, true);
  view.setFloat32(28, 1.5, true);
  view.setFloat32(36, -3, true);
  view.setUint32(40, 99, true);
  view.setUint16(44, 7, true);
  view.setUint16(46, 16384, true);
  const rows = decodeRows(bytes);
  assert.equal(rows.count, 2);
  assert.equal(rows.place[1], 70000);
  assert.deepEqual([...rows.position.slice(3)], [1.5, 0, -3]);
  assert.equal(rows.stamp[1], 99);
  assert.equal(rows.session[1], 7);
  assert.ok(Math.abs(rows.heading[1] - Math.PI / 2) < 1e-6);
});

test('from afar the first square is enough, from near those in view are added', () => {
  const all = { minX: -100, minY: -100, maxX: 1100, maxY: 1100 };
  assert.deepEqual(chooseTiles(SQUARES, { ...all, pxPerM: 0.1 }), [0]);
  assert.deepEqual(chooseTiles(SQUARES, { ...all, pxPerM: 0.2 }), [0, 1, 3]);
  assert.deepEqual(chooseTiles(SQUARES, { ...all, pxPerM: 10 }), [0, 1, 3, 2]);
  const corner = { minX: 800, minY: 800, maxX: 900, maxY: 900, pxPerM: 10 };
  assert.deepEqual(chooseTiles(SQUARES, corner), [0, 3]);
});

test('squares are fetched once, as views ask for them', async () => {
  const asked: string[] = [];
  const api = { bytes: async (path: string) => { asked.push(path); return new ArrayBuffer(24); } } as unknown as Api;
  const list = { content_id: 'id', tiles: SQUARES } as unknown as TileList;
  let numArrived = 0;
  const store = new TileStore(api, '/v1/maps/town', list, () => { ++numArrived; }, () => assert.fail());
  assert.deepEqual(store.want([0, 1]), []);
  assert.equal(store.isComplete, false);
  await new Promise(setImmediate);
  assert.equal(store.want([0, 1]).length, 2);
  assert.equal(store.isComplete, true);
  assert.equal(numArrived, 2);
  assert.deepEqual(asked, ['/v1/maps/town/tiles/0?content_id=id', '/v1/maps/town/tiles/1?content_id=id']);
});

test('a square that cannot be had is told of and not asked for again and again', async () => {
  let numAsked = 0;
  const api = { bytes: async () => { ++numAsked; throw new Error('gone'); } } as unknown as Api;
  const told: string[] = [];
  const store = new TileStore(api, '', { content_id: '', tiles: SQUARES } as unknown as TileList,
      () => assert.fail(), (error) => told.push(error.message));
  store.want([0]);
  await new Promise(setImmediate);
  await new Promise(setImmediate);
  assert.equal(numAsked, 1);
  assert.deepEqual(told, ['gone']);
});
