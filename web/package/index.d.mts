/** What went wrong: a sentence to show, and a word to tell kinds apart. */
export class AnchorsplatError extends Error {
  code: 'bad_argument' | 'bad_file' | 'not_found' | 'exists' | 'io' | 'interrupted' | 'crashed';
}

export interface Message {
  level: 'info' | 'warning' | 'error';
  text: string;
}

export interface Progress {
  task: string;
  done: number;
  /** Steps in all; 0: unknown. */
  total: number;
  note: string;
}

type RenderMode = 'classic' | 'antialiased' | 'mip';
/** What is made here lies in memory of its own, as `Blob` wants it. */
type Made = Uint8Array & {readonly buffer: ArrayBuffer};
type Numbers = Float32Array & {readonly buffer: ArrayBuffer};
type Bytes = Uint8Array | ArrayBuffer | ArrayBufferView | Blob;

export interface OpenOptions {
  /** The file's name: formats without a mark of their own are found by its extension. */
  name?: string;
  /** What the file is, whatever its name and content say: "spz". */
  format?: string;
  onMessage?: (message: Message) => void;
}

/** Rows belong to Gaussians. Values as an INRIA PLY has them: log-scales, opacity logits, quaternions wxyz of any norm. */
export interface Columns {
  count?: number;
  shDegree?: 0 | 1 | 2 | 3;
  /** [N,3] */
  means: Float32Array;
  /** [N,3] */
  logScales: Float32Array;
  /** [N,4] */
  quats: Float32Array;
  /** [N] */
  opacityLogits: Float32Array;
  /** [N,(shDegree+1)²,3], coefficient-major */
  sh: Float32Array;
  renderMode?: RenderMode | null;
  comments?: string[];
  /** What centres are relative to, in world units: position = origin + mean. */
  origin?: [number, number, number];
}

/** Cameras that readCameras() has read. */
export interface Cameras {
  readonly count: number;
}

export interface CameraFile {
  name: string;
  data: Bytes;
}

/** The options of `anchorsplat enhance`; defaults are those of the command line. */
export interface EnhanceOptions {
  method?: string;
  quality?: 'fast' | 'good' | 'best';
  /** How many times closer it will be seen; 4. */
  upscale?: number;
  /** World size of one training pixel, or "auto". */
  pixelSize?: number | 'auto';
  mode?: RenderMode;
  cameras?: Cameras;
  trainWidth?: number;
  cameraRule?: 'auto' | 'smallest' | 'median';
  filterStrength?: number;
  clean?: boolean;
  background?: [number, number, number];
  copies?: 'auto' | number;
  mergeCost?: number;
  /** Of the result at most; 0: no bound. */
  maxGaussians?: number;
  /** Only what lies in there is enhanced, the rest stays bit by bit: a sphere [x, y, z, radius], or a box by two corners. */
  region?: [number, number, number, number] | [number, number, number, number, number, number];
  pruneOpacity?: number;
  blockGaussians?: number;
  seed?: number;
  /** Stops it at once; the promise is rejected with the code "interrupted". */
  signal?: AbortSignal;
  onProgress?: (progress: Progress) => void;
  onMessage?: (message: Message) => void;
}

type Vector = [number, number, number];
type Box = [number | null, number | null, number | null, number | null, number | null, number | null];

/** An edit of `anchorsplat convert`. */
export interface Edit {
  translate?: Vector;
  /** Degrees about x, then y, then z. */
  rotate?: Vector;
  scale?: number;
  mirror?: 'x' | 'y' | 'z';
  /** Turns so that this direction becomes up, −y: three numbers, or an axis as "-z". */
  up?: Vector | string;
  /** Moves so that this point becomes 0, 0, 0. */
  origin?: Vector;
  /** Keeps what lies in the box between two corners; null: no border. */
  filterBox?: Box;
  /** Drops what lies in the box. */
  removeBox?: Box;
  /** Keeps what is nearer to x, y, z than the radius. */
  filterSphere?: [number, number, number, number];
  filterNan?: boolean;
  /** Property, comparison, value: ["opacity", "gte", 0.1]. */
  filterValue?: [string, 'lt' | 'lte' | 'gt' | 'gte' | 'eq' | 'neq', number];
  filterHarmonics?: 0 | 1 | 2 | 3;
  /** true, or a factor: above 1 finds fewer. */
  filterFloaters?: boolean | number;
}

export interface EditOptions {
  /** Along which numbers count: "RDF", the default, as in the columns (x right, y down, z forward); "LUF" as the command line has them. */
  axes?: string;
  onMessage?: (message: Message) => void;
}

export interface EditCount {
  /** In the words of the command line. */
  action: string;
  /** Gaussians that it took away. */
  taken: number;
  left: number;
}

/** Where points are: scale · rotation · p + translation; the rotation is row-major. */
export interface World {
  rotation: number[];
  translation: number[];
  scale: number;
}

export interface WriteOptions {
  sort?: 'format' | 'keep' | 'morton' | 'importance';
  spzVersion?: 3 | 4;
  onMessage?: (message: Message) => void;
}

export interface RenderOptions {
  cameras?: Cameras;
  /** Views around the splat, where there are no cameras. */
  orbit?: number;
  radius?: number;
  target?: [number, number, number];
  fov?: number;
  up?: string | [number, number, number];
  view?: string;
  size?: [number, number];
  background?: [number, number, number];
  near?: number;
  far?: number;
  mode?: RenderMode;
  profile?: 'gsplat14' | 'gsplat15';
  transparent?: boolean;
  onProgress?: (progress: Progress) => void;
  onMessage?: (message: Message) => void;
}

export interface PageOptions {
  before?: Splat;
  name?: string;
  cameras?: Cameras;
  title?: string;
  /** Address of a page that a button of this one opens. */
  openYourOwn?: string;
  views?: number;
  pixelSize?: number | 'auto';
  shDegree?: 0 | 1 | 2 | 3;
  mode?: RenderMode;
  background?: [number, number, number];
  onMessage?: (message: Message) => void;
}

/** A splat that the engine holds; it does not change. */
export class Splat {
  private constructor();
  readonly count: number;
  readonly shDegree: 0 | 1 | 2 | 3;
  readonly renderMode: RenderMode | null;
  readonly comments: string[];
  /** What centres are relative to, in world units: position = origin + mean. Zero but for coordinates too large for floats. */
  readonly origin: [number, number, number];
  /** Of its file; null: it came from no file. */
  readonly format: string | null;
  /** What `anchorsplat info --json` says; `reading` and `treatment` are what it looks like and what would help it. */
  info(): Promise<Record<string, unknown>>;
  enhance(options?: EnhanceOptions): Promise<{splat: Splat; report: Record<string, unknown>}>;
  /** Turned, moved, scaled, cropped and cleaned, in this order; this splat stays as it is. */
  edit(edits: Edit | Edit[], options?: EditOptions): Promise<{splat: Splat; actions: EditCount[]; world: World}>;
  /** What each edit would take away. */
  countEdits(edits: Edit | Edit[], options?: EditOptions): Promise<EditCount[]>;
  /** Variance that the filter adds to every axis, for a training pixel of size 1. */
  filterGain(upscale?: number): Promise<number>;
  /** The bytes of a file: "ply", "compressed.ply", "spz", "sog", "splat", "glb", … */
  write(format: string, options?: WriteOptions): Promise<Made>;
  /** The page of `anchorsplat view`: one HTML file that opens anywhere. */
  page(options?: PageOptions): Promise<Made>;
  /** float32 [views, height, width, channels], from 0 to 1. */
  render(options?: RenderOptions): Promise<{views: number; height: number; width: number; channels: 3 | 4; pixels: Numbers}>;
  columns(): Promise<Required<Columns>>;
  /** Gives its memory back. */
  close(): Promise<void>;
}

export function open(data: Bytes, options?: OpenOptions): Promise<Splat>;
export function fromColumns(columns: Columns): Promise<Splat>;
/** transforms.json, cameras.json, or the files of a COLMAP model. */
export function readCameras(files: CameraFile | CameraFile[]): Promise<Cameras>;
export function formats(): Promise<{name: string; extensions: string[]; reads: boolean; writes: boolean}[]>;
export function convert(data: Bytes, options: {to: string; from?: string; name?: string} & WriteOptions): Promise<Made>;
/**
 * Threads that the engine may use, from the next one on (`close()` ends the one that there is); 1: the module without.
 * null, the default: as many as there are processors, 8 at most. A page that is not isolated from other origins has one.
 * Results do not depend on it.
 */
export function setThreads(threads: number | null): void;
/** Ends the engine: all splats that are open are gone. */
export function close(): Promise<void>;
