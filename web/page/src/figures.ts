// Small drawings beside the map: a scan laid on a place, and the contexts of a place.
import type { Candidate, Context, PlaceDetails } from './api.ts';
import { agreement, postsInMap } from './geometry.ts';
import { outcomeColour, ramp } from './palette.ts';

/** Posts that are so near to one of the place's agree with it, as a person would say [m]. */
const AGREE_M = 0.75;

function inkOf(canvas: HTMLCanvasElement, name: string): string {
  return getComputedStyle(canvas.ownerDocument.documentElement).getPropertyValue(name).trim();
}

/** The scan's structure on the place's, seen from above, as the candidate lays it. Returns the
 *  shares of the scan and of the place that agree: one that saw less, behind a bus, has less to lie on. */
export function drawOverlay(canvas: HTMLCanvasElement, scan_cm: number[], candidate: Candidate,
                            place: PlaceDetails, dark: boolean, reachM = 45): { ofScan: number; ofPlace: number } {
  const side = 480;
  canvas.width = side;
  canvas.height = side;
  const context = canvas.getContext('2d')!;
  const scan = postsInMap(scan_cm, candidate.T_map_query);
  const mapped = postsInMap(place.posts_cm, place.T_map_place);
  const centre = candidate.T_map_query;
  const at = (x: number, y: number): [number, number] => [
    side / 2 + ((x - centre.x) / reachM) * (side / 2),
    side / 2 - ((y - centre.y) / reachM) * (side / 2),
  ];
  context.fillStyle = inkOf(canvas, '--faint');
  for (let i = 0; i + 1 < mapped.length; i += 2) {
    const [x, y] = at(mapped[i], mapped[i + 1]);
    context.fillRect(x - 3, y - 3, 6, 6);
  }
  const agrees = agreement(scan, mapped, AGREE_M);
  const good = `rgb(${outcomeColour('localized', dark).join()})`;
  const bad = `rgb(${outcomeColour('not_recognized', dark).join()})`;
  agrees.forEach((isGood, i) => {
    const [x, y] = at(scan[2 * i], scan[2 * i + 1]);
    context.strokeStyle = isGood ? good : bad;
    context.fillStyle = good;
    context.lineWidth = 2;
    context.beginPath();
    if (isGood) {
      context.arc(x, y, 3, 0, 2 * Math.PI);
      context.fill();
    } else {
      context.moveTo(x - 4, y - 4);
      context.lineTo(x + 4, y + 4);
      context.moveTo(x + 4, y - 4);
      context.lineTo(x - 4, y + 4);
      context.stroke();
    }
  });
  context.strokeStyle = inkOf(canvas, '--ink');
  context.lineWidth = 2;
  const scale = at(centre.x + 10, centre.y)[0] - side / 2;
  context.fillStyle = inkOf(canvas, '--panel');
  context.fillRect(6, side - 50, Math.max(scale, 60) + 20, 44);
  context.beginPath();
  context.moveTo(16, side - 18);
  context.lineTo(16 + scale, side - 18);
  context.stroke();
  context.fillStyle = inkOf(canvas, '--ink');
  context.font = '22px sans-serif';
  context.fillText('10 m', 16, side - 26);
  context.beginPath();  // the robot
  context.arc(side / 2, side / 2, 7, 0, 2 * Math.PI);
  context.stroke();
  const shareOf = (agreeing: boolean[]) => agreeing.filter(Boolean).length / Math.max(agreeing.length, 1);
  return { ofScan: shareOf(agrees), ofPlace: shareOf(agreement(mapped, scan, AGREE_M)) };
}

/** Heights as colours, rows upwards; empty bins are left open. */
export function drawContext(canvas: HTMLCanvasElement, told: Context): number {
  canvas.width = told.num_cols;
  canvas.height = told.num_rows;
  canvas.style.imageRendering = 'pixelated';
  canvas.style.aspectRatio = '2 / 1';
  const highest = told.cells_cm.reduce((most, cell) => Math.max(most, cell), 1);
  const context = canvas.getContext('2d')!;
  const image = context.createImageData(told.num_cols, told.num_rows);
  for (let col = 0; col < told.num_cols; ++col) {
    for (let row = 0; row < told.num_rows; ++row) {
      const cell = told.cells_cm[col * told.num_rows + row];
      if (cell === 0) continue;
      const at = 4 * ((told.num_rows - 1 - row) * told.num_cols + col);
      image.data.set([...ramp(cell / highest), 255], at);
    }
  }
  context.putImageData(image, 0, 0);
  return highest;
}
