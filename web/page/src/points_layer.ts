// Points with a mark, a size and a colour each.
//
// deck.gl's own layers draw an instance a point, which software rendering takes one by one: 50,000
// of them last a second there. These are one draw of GL points.
import { Layer, type LayerProps, picking, project32, type UpdateParameters } from '@deck.gl/core';
import { Model } from '@luma.gl/engine';
import type { ShaderModule } from '@luma.gl/shadertools';
import type { Mark } from './palette.ts';

const MARKS: Mark[] = ['disc', 'triangle', 'cross', 'square', 'ring'];

type Rgb = readonly [number, number, number];

/** Points to draw; of a map's places there are many, of all else few. */
export class Points {
  readonly positions: Float32Array;
  readonly colors: Uint8Array;
  readonly marks: Float32Array;
  constructor(readonly length: number, positions?: Float32Array) {
    this.positions = positions ?? new Float32Array(3 * length);
    this.colors = new Uint8Array(4 * length);
    this.marks = new Float32Array(2 * length).fill(1);
    for (let i = 0; i < length; ++i) this.marks[2 * i + 1] = 0;
  }

  /** a from 0 to 255; one with 0 is not drawn. */
  colour(i: number, [r, g, b]: Rgb, a: number): void {
    this.colors[4 * i] = r;
    this.colors[4 * i + 1] = g;
    this.colors[4 * i + 2] = b;
    this.colors[4 * i + 3] = a;
  }

  set(i: number, x: number, y: number, mark: Mark, size: number, rgb: Rgb, a = 255): void {
    this.positions[3 * i] = x;
    this.positions[3 * i + 1] = y;
    this.marks[2 * i] = size;
    this.marks[2 * i + 1] = MARKS.indexOf(mark);
    this.colour(i, rgb, a);
  }

  /** As deck.gl takes it; the same object until the points are others. */
  readonly data = {
    length: 0,
    attributes: {} as Record<string, { value: Float32Array | Uint8Array; size: number; normalized?: boolean }>,
  };
  finish(): this {
    this.data.length = this.length;
    this.data.attributes = {
      positions: { value: this.positions, size: 3 },
      colors: { value: this.colors, size: 4, normalized: true },
      marks: { value: this.marks, size: 2 },
    };
    return this;
  }
}

interface PointsLayerProps extends LayerProps {
  data: Points['data'];
  /** Pixels of a point of size 1. */
  scale: number;
  /** Around each mark. */
  edge: Rgb;
}

const uniforms = {
  name: 'points',
  vs: 'uniform pointsUniforms { float scale; float edgeWidth; vec3 edge; } points;\n',
  fs: 'uniform pointsUniforms { float scale; float edgeWidth; vec3 edge; } points;\n',
  uniformTypes: { scale: 'f32', edgeWidth: 'f32', edge: 'vec3<f32>' },
} as const satisfies ShaderModule<{ scale: number; edgeWidth: number; edge: Rgb }>;

const VERTEX = `#version 300 es
#define SHADER_NAME points-vertex
in vec3 positions;
in vec4 colors;
in vec2 marks;
out vec4 colour;
flat out float mark;
flat out float size;
void main(void) {
  gl_Position = project_position_to_clipspace(vec3(positions.xy, 0.0), vec3(0.0), vec3(0.0));
  size = marks.x * points.scale;
  gl_PointSize = colors.a == 0.0 ? 0.0 : size;
  colour = colors;
  mark = marks.y;
}`;

// How far the fragment lies within the mark, in shares of its size; negative outside.
const FRAGMENT = `#version 300 es
#define SHADER_NAME points-fragment
precision highp float;
in vec4 colour;
flat in float mark;
flat in float size;
out vec4 fragColor;
void main(void) {
  if (colour.a == 0.0) discard;
  vec2 p = gl_PointCoord - 0.5;
  float disc = 0.5 - length(p);
  float within = disc;
  if (mark > 3.5) {
    within = min(disc, length(p) - 0.5 + max(0.09, 2.0 / size));
  } else if (mark > 2.5) {
    vec2 q = abs(p);
    within = 0.4 - max(q.x, q.y);
    if (within > 0.16) discard;
  } else if (mark > 1.5) {
    vec2 q = abs(vec2(p.x + p.y, p.x - p.y)) * 0.7071;
    within = min(0.19 - min(q.x, q.y), 0.58 - max(q.x, q.y));
  } else if (mark > 0.5) {
    within = min(0.42 - p.y, (p.y + 0.5) * 0.447 - abs(p.x) * 0.894 + 0.02);
  }
  if (within < 0.0) discard;
  bool isEdge = points.edgeWidth > 0.0 && mark < 3.5 && within * size < points.edgeWidth;
  fragColor = vec4(isEdge ? points.edge : colour.rgb, colour.a);
}`;

export class PointsLayer extends Layer<PointsLayerProps> {
  static override layerName = 'PointsLayer';
  declare state: { model: Model };

  override initializeState(): void {
    const attributes = this.getAttributeManager()!;
    attributes.remove(['instancePickingColors']);
    attributes.add({
      positions: { size: 3, type: 'float32', noAlloc: true },
      colors: { size: 4, type: 'unorm8', noAlloc: true },
      marks: { size: 2, type: 'float32', noAlloc: true },
    });
    this.setState({
      model: new Model(this.context.device, {
        ...super.getShaders({ vs: VERTEX, fs: FRAGMENT, modules: [project32, picking, uniforms] }),
        id: this.props.id, topology: 'point-list',
        bufferLayout: attributes.getBufferLayouts(), vertexCount: 0, isInstanced: false,
      } as never),
    });
  }

  override getNumInstances(): number { return this.props.data.length; }

  override updateState(parameters: UpdateParameters<this>): void {
    super.updateState(parameters);
    this.state.model.setVertexCount(this.props.data.length);
  }

  override draw(): void {
    const { model } = this.state;
    const dense = Number(this.context.deck!.props.useDevicePixels) || 1;
    const [r, g, b] = this.props.edge;
    model.shaderInputs.setProps({
      points: {
        scale: this.props.scale * dense,
        edgeWidth: this.props.scale > 1 ? 0 : 1.2 * dense,
        edge: [r / 255, g / 255, b / 255],
      },
    });
    model.draw(this.context.renderPass);
  }

  override finalizeState(context: never): void {
    super.finalizeState(context);
    this.state.model.destroy();
  }
}
