import { Camera, IUniform, Material, Object3D, Scene, ShaderMaterial, Texture, WebGLRenderTarget, WebGLRenderer } from 'three';

export const FORMAT: 'rtgi-three-style/1';

/** The style of a .json and of the picture of ramps beside it. */
export function loadStyle(url: string | URL): Promise<RTGIStyle>;

/** Bands, ramps, highlights and rims for lit materials of WebGLRenderer. */
export class RTGIStyle {
  /** @throws Error for a description of another format. */
  constructor(description: object, ramps: Texture);
  /** GLSL of surfaces (`tone`) and of the pass over the screen (`lines`), for shaders of your own with `uniforms`. */
  readonly glsl: { tone: string; lines: string };
  /** `style_NAME` for every value of the style. */
  readonly uniforms: Record<string, IUniform>;
  /** Draw a material, or every lit one below an object, in the style; after the probes' `apply`. */
  apply(target: Material | Object3D): this;
  /** Give it back as it was; before the probes' `release`. */
  release(target: Material | Object3D): this;
  dispose(): void;
}

/** Draws a scene with lines, paper and grading over it. */
export class RTGIStyleView {
  constructor(style: RTGIStyle);
  readonly style: RTGIStyle;
  readonly picture: WebGLRenderTarget;
  /** Normals, depths and numbers of what is seen. */
  readonly surfaces: WebGLRenderTarget;
  readonly material: ShaderMaterial;
  readonly surfaceMaterial: ShaderMaterial;
  /** Draws to the renderer's current target; `draw` is how the scene is drawn before lines. */
  render(renderer: WebGLRenderer, scene: Scene, camera: Camera,
    draw?: (renderer: WebGLRenderer, scene: Scene, camera: Camera) => void): void;
  dispose(): void;
}
