import { WebGLRenderer } from "three";

/** Whether WebGL is drawn by the processor: then smooth edges and slanted textures cost more than they are worth. */
let software: boolean | null = null;

/** Null where the browser gives no WebGL. */
export function makeRenderer(): WebGLRenderer | null {
  try {
    if (software !== null) return rendererWith(!software);
    // The first tells who draws; a context costs a graphics card little, and a processor much.
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

/** Samples of a texture along a slanted surface. */
export const anisotropy = () => (software ? 1 : 8);
