const MAX_SCALE_PX = 110;

/** A round length that has room in the corner. */
export function scaleFor(pxPerM: number): { metres: number; text: string } {
  let metres = 0.1;
  for (let power = 0.1; power <= 1e5; power *= 10) {
    for (const n of [1, 2, 5]) if (n * power * pxPerM <= MAX_SCALE_PX) metres = n * power;
  }
  return { metres, text: metres >= 1000 ? `${Math.round(metres / 1000)} km` : `${Number(metres.toFixed(1))} m` };
}
