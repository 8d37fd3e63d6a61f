/** Whether WebGL is drawn by the processor: then smooth edges and slanted textures cost more than they are worth. */
export const software = (() => {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) return false;
  const about = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(about ? gl.getParameter(about.UNMASKED_RENDERER_WEBGL) : "");
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
})();

/** Samples of a texture along a slanted surface. */
export const anisotropy = software ? 1 : 8;
