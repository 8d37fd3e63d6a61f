import { defineConfig } from "vite";

// `npm run dev` serves the page with reloading, and passes /api on to `esim studio --port 8391`.
export default defineConfig({
  base: "/",
  build: { outDir: "dist", assetsInlineLimit: 0, modulePreload: { polyfill: false }, chunkSizeWarningLimit: 1500 },
  server: { proxy: { "/api": { target: "http://127.0.0.1:8391", headers: { Origin: "http://127.0.0.1:8391" } } } },
});
