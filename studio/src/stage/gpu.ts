import { WebGLRenderer } from "three";

/** Whether the processor draws WebGL, which makes antialiasing and anisotropic filtering too slow. */
let software: boolean | null = null;

/** Null if the browser does not support WebGL. */
export function makeRenderer(): WebGLRenderer | null {
  try {
    if (software !== null) return rendererWith(!software);
    // The first context tells whether the processor draws, for which a context is expensive.
    const first = rendererWith(false);
    software = isSoftware(first.getContext());
    if (software) return first;
    first.forceContextLoss();
    first.dispose();
    return rendererWith(true);
  } catch {
    return null;
  }
}

const rendererWith = (antialias: boolean) => new WebGLRenderer({ antialias, powerPreference: "high-performance" });

function isSoftware(gl: WebGLRenderingContext | WebGL2RenderingContext): boolean {
  const about = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(about ? gl.getParameter(about.UNMASKED_RENDERER_WEBGL) : "");
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

export const drawnBySoftware = () => software === true;

/** Anisotropy of textures. */
export const anisotropy = () => (software ? 1 : 8);
