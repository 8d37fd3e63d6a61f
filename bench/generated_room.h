#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <random>

#include "esim/scene/scene.h"

namespace esim::bench {

/// Blotches and grain at every scale, 2048 x 2048.
inline std::shared_ptr<const Texture> grainy_texture(unsigned seed) {
  constexpr int kSize = 2048;
  std::mt19937 random(seed);
  Image<float> image(kSize, kSize, 0.5F);
  for (int cell = 512; cell >= 1; cell /= 4) {
    Image<float> noise(kSize / cell, kSize / cell);
    for (float& value : noise.pixels()) value = static_cast<float>(random() % 1024) / 1024.0F - 0.5F;
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) image(x, y) += 0.15F * noise(x / cell, y / cell);
    }
  }
  return std::make_shared<const Texture>(image, Wrap::repeat, Wrap::repeat);
}

/// Appends a surface position(s, t), s and t on [0, 1], as `columns` x `rows` quadrilaterals.
template <typename Position>
void append_surface(Mesh& mesh, int columns, int rows, std::uint32_t material, const Position& position) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto stride = static_cast<std::uint32_t>(columns + 1);
  const auto uv = [&](int i, int j) {
    return Eigen::Vector2f(static_cast<float>(i) / static_cast<float>(columns),
                           static_cast<float>(j) / static_cast<float>(rows));
  };
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) mesh.vertices.push_back(position(uv(i, j).x(), uv(i, j).y()));
  }
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const std::uint32_t corner = first + static_cast<std::uint32_t>(j) * stride + static_cast<std::uint32_t>(i);
      mesh.triangles.push_back({corner, corner + 1, corner + stride + 1});
      mesh.texture_uv.push_back({uv(i, j), uv(i + 1, j), uv(i + 1, j + 1)});
      mesh.triangles.push_back({corner, corner + stride + 1, corner + stride});
      mesh.texture_uv.push_back({uv(i, j), uv(i + 1, j + 1), uv(i, j + 1)});
      mesh.material.insert(mesh.material.end(), {material, material});
    }
  }
}

/// A room of 8 x 6 x 4 m around the origin with uneven walls and twelve balls in it, of about `triangles` triangles and
/// three grainy textures of 2048 x 2048.
inline Mesh generated_room(int triangles) {
  Mesh mesh;
  for (unsigned seed = 0; seed < 3; ++seed) mesh.materials.push_back({"grain", grainy_texture(seed), 1.0F});
  // Half of the triangles on six walls, half on twelve balls.
  const int wall = std::max(1, static_cast<int>(std::lround(std::sqrt(triangles / 24.0))));
  const int ball = std::max(4, static_cast<int>(std::lround(std::sqrt(triangles / 96.0))));
  constexpr float kPi = std::numbers::pi_v<float>;
  const Eigen::Vector3f half(4, 3, 2);
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0F, 1.0F}) {
      append_surface(mesh, wall, wall, static_cast<std::uint32_t>(axis), [&](float s, float t) {
        Eigen::Vector3f p;
        const int a = (axis + 1) % 3, b = (axis + 2) % 3;
        p[a] = (2 * s - 1) * half[a], p[b] = (2 * t - 1) * half[b];
        p[axis] = side * (half[axis] + 0.03F * std::sin(12 * kPi * s) * std::sin(8 * kPi * t));
        return p;
      });
    }
  }
  for (int i = 0; i < 12; ++i) {
    const float angle = static_cast<float>(i) * kPi / 6;
    const Eigen::Vector3f centre(2.6F * std::cos(angle), 2.0F * std::sin(angle), 0.9F * std::sin(5 * angle));
    append_surface(mesh, 2 * ball, ball, static_cast<std::uint32_t>(i % 3), [&](float s, float t) {
      const float longitude = 2 * kPi * s, latitude = kPi * (t - 0.5F);
      return Eigen::Vector3f(centre + 0.4F * Eigen::Vector3f(std::cos(latitude) * std::cos(longitude),
                                                             std::cos(latitude) * std::sin(longitude),
                                                             std::sin(latitude)));
    });
  }
  return mesh;
}

}  // namespace esim::bench
