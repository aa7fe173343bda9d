// What scanloc-web tells (web/openapi.json), or a snapshot of it.

export interface Point { x: number; y: number; z: number }
export interface Pose extends Point { qx: number; qy: number; qz: number; qw: number }
/** On earth, of a map that knows where it stands. */
export interface GeoPose { latitude: number; longitude: number; altitude_m: number; heading_deg: number }
export type Outcome = 'localized' | 'ambiguous' | 'not_recognized' | 'insufficient_scan';
export interface Candidate {
  place: number; session: string; distance: number; confidence: number | null;
  T_map_place: Pose; T_map_query: Pose; std_x_m?: number; std_y_m?: number; std_yaw_deg?: number;
  geo?: GeoPose;
}
export interface Answer {
  map: string; content_id: string; outcome: Outcome; reason: string; candidates: Candidate[];
  posts_cm?: number[];
}
export interface SeenAnswer {
  number: number; answered_ns: number; request_id: string; client: string; is_of_stream: boolean;
  answer: Answer; posts_cm: number[];
}
export interface MapSummary { name: string; state: string; num_places: number }
export interface MapInfo {
  name: string; content_id: string; num_places: number; sessions: string[];
  extent: { min: Point; max: Point } | null; min_confidence: number;
}
export interface Context { num_rows: number; num_cols: number; cells_cm: number[] }
export interface PlaceDetails {
  content_id: string; place: number; session: number; stamp_ns: number; T_map_place: Pose;
  polar: Context | null; cart: Context | null; posts_cm: number[]; geo?: GeoPose;
}
export interface Pair { place: number; lookalike: number; confidence: number; from: Point; to: Point }
export interface TileSquare { level: number; x: number; y: number; side: number; count: number }
export interface TileList {
  content_id: string; num_places: number; origin: Point; first_stamp_ns: number; row_bytes: number;
  floors: { min_z_m: number; max_z_m: number; count: number }[]; tiles: TileSquare[];
}
interface Recorded { json?: unknown; base64?: string }
export interface Snapshot { map: string; responses: Record<string, Recorded> }

export class ApiError extends Error {
  constructor(readonly status: number, message: string) { super(message); }
}

/** Takes a stream of server-sent events apart, however it is cut into pieces. */
export class EventParser {
  private rest = '';
  constructor(private readonly tell: (data: string, id: string) => void) {}

  push(text: string): void {
    this.rest += text;
    for (let end = this.rest.indexOf('\n\n'); end >= 0; end = this.rest.indexOf('\n\n')) {
      let data = '';
      let id = '';
      for (const line of this.rest.slice(0, end).split('\n')) {
        if (line.startsWith('data: ')) data += line.slice(6);
        if (line.startsWith('id: ')) id = line.slice(4);
      }
      this.rest = this.rest.slice(end + 2);
      if (data) this.tell(data, id);
    }
  }
}

function bytesOf(base64: string): ArrayBuffer {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes.buffer;
}

/** How a map's places fared in use, as its server counted it. */
export interface MapUse {
  until_ns: number;
  places: {
    place: number; num_found: number; num_refused: number; confidence: number; recent_disagreement: number;
    last_found_ns: number;
  }[];
}

export class Api {
  token = '';
  constructor(readonly snapshot: Snapshot | null) {}

  private async ask(path: string, init: RequestInit = {}): Promise<Response> {
    const headers = new Headers(init.headers);
    if (this.token) headers.set('Authorization', `Bearer ${this.token}`);
    const response = await fetch(path, { ...init, headers });
    if (response.ok) return response;
    const told = await response.json().catch(() => null);
    throw new ApiError(response.status, told?.error?.message ?? `status ${response.status}`);
  }

  private recorded(path: string): Recorded {
    const found = this.snapshot?.responses[path.split('?')[0]];
    if (!found) throw new ApiError(404, 'this is not in the snapshot');
    return found;
  }

  async json<T>(path: string): Promise<T> {
    if (this.snapshot) return this.recorded(path).json as T;
    return (await this.ask(path)).json();
  }

  async bytes(path: string): Promise<ArrayBuffer> {
    if (this.snapshot) return bytesOf(this.recorded(path).base64 ?? '');
    return (await this.ask(path)).arrayBuffer();
  }

  async localize(map: string, scan: Blob, requestId: string): Promise<Answer> {
    if (this.snapshot) throw new ApiError(400, 'a snapshot answers no scans; ask a scanloc-web');
    const query = new URLSearchParams({ map, top: '5', structure: 'true' });
    const response = await this.ask(`/v1/localize?${query}`, {
      method: 'POST', body: scan, headers: { 'X-Request-Id': requestId },
    });
    return response.json();
  }

  /** Tells of every answer as it comes, and of trouble; goes on after a break where it was. */
  async watch(map: string, signal: AbortSignal, tell: (answer: SeenAnswer) => void,
              trouble: (error: Error | null) => void): Promise<void> {
    let last = '';
    const parser = () => new EventParser((data, id) => {
      last = id;
      tell(JSON.parse(data) as SeenAnswer);
    });
    for (let wait = 1000; !signal.aborted; wait = Math.min(2 * wait, 15000)) {
      try {
        const query = new URLSearchParams({ map, last_event_id: last });
        const response = await this.ask(`/v1/events?${query}`, { signal });
        trouble(null);
        wait = 500;
        const reader = response.body!.pipeThrough(new TextDecoderStream()).getReader();
        const events = parser();
        for (let piece = await reader.read(); !piece.done; piece = await reader.read()) {
          events.push(piece.value);
        }
      } catch (error) {
        if (signal.aborted) return;
        trouble(error as Error);
        // What is refused for good is not asked again.
        if (error instanceof ApiError && [401, 403, 404, 501].includes(error.status)) return;
      }
      await new Promise((again) => setTimeout(again, wait));
    }
  }
}
