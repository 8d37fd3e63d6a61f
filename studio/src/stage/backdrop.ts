import {
  BufferGeometry,
  Float32BufferAttribute,
  LinearFilter,
  Mesh,
  MeshBasicMaterial,
  PlaneGeometry,
  RepeatWrapping,
  type Texture,
  Vector3,
} from "three";
import type { SceneInfo } from "../api/types.ts";
import type { Environment } from "./environment.ts";
import { matrixOf } from "./frames.ts";

const panorama_radius_m = 200;

/** The image's centre is along x, its upper edge at the zenith, its right half to the right (towards -y). */
export function makePanorama(texture: Texture, orientation: [number, number, number, number] = [0, 0, 0, 1]): Mesh {
  const [columns, rows] = [96, 48];
  const [positions, uvs, indices] = [[] as number[], [] as number[], [] as number[]];
  for (let row = 0; row <= rows; ++row) {
    const elevation = Math.PI * (0.5 - row / rows);
    for (let column = 0; column <= columns; ++column) {
      const azimuth = Math.PI - (2 * Math.PI * column) / columns;
      positions.push(
        panorama_radius_m * Math.cos(elevation) * Math.cos(azimuth),
        panorama_radius_m * Math.cos(elevation) * Math.sin(azimuth),
        panorama_radius_m * Math.sin(elevation),
      );
      uvs.push(column / columns, 1 - row / rows);
      if (row === rows || column === columns) continue;
      const corner = row * (columns + 1) + column;
      indices.push(corner, corner + 1, corner + columns + 1, corner + 1, corner + columns + 2, corner + columns + 1);
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(positions, 3));
  geometry.setAttribute("uv", new Float32BufferAttribute(uvs, 2));
  geometry.setIndex(indices);
  texture.minFilter = LinearFilter; // mipmaps would show the seam
  const mesh = new Mesh(geometry, new MeshBasicMaterial({ map: texture, side: 2, depthWrite: false }));
  mesh.quaternion.set(...orientation).normalize();
  return mesh;
}

/** The environment behind the surfaces, which is nowhere to point at. */
export function makeSky({ texture, turned_rad }: Environment): Mesh {
  const sky = makePanorama(texture);
  sky.rotation.z = turned_rad;
  sky.frustumCulled = false;
  sky.onBeforeRender = (_renderer, _scene, camera) => {
    sky.matrixWorld.setPosition(new Vector3().setFromMatrixPosition(camera.matrixWorld)); // infinitely far
  };
  sky.raycast = () => undefined;
  return sky;
}

/** The plane's frame has its origin at the image's centre, x right and y down. */
export function makePlane(texture: Texture, info: SceneInfo): Mesh {
  const { pose, width_m, height_m, endless } = info.world!.plane!;
  const repeat = endless ? 41 : 1;
  if (endless) {
    texture.wrapS = texture.wrapT = RepeatWrapping;
    texture.repeat.set(repeat, repeat);
  }
  const mesh = new Mesh(
    new PlaneGeometry(width_m * repeat, height_m * repeat),
    new MeshBasicMaterial({ map: texture, side: 2 }),
  );
  mesh.geometry.rotateX(Math.PI); // y down, seen from -z
  mesh.applyMatrix4(matrixOf(pose));
  return mesh;
}
