#include "esim/studio/scene_view/coarse.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

namespace esim::studio {
namespace {

struct Sheet {
  std::vector<float> positions, texture_uv;
  std::vector<std::uint32_t> indices;

  Surface surface() const { return {positions, texture_uv, indices}; }
  Eigen::Vector3f at(std::uint32_t vertex) const { return Eigen::Map<const Eigen::Vector3f>(&positions[3 * vertex]); }

  double area(const std::vector<std::uint32_t>& triangles) const {
    double sum = 0;
    for (std::size_t i = 0; i < triangles.size(); i += 3) {
      const Eigen::Vector3f a = at(triangles[i]);
      sum += 0.5 * (at(triangles[i + 1]) - a).cross(at(triangles[i + 2]) - a).norm();
    }
    return sum;
  }
};

/// n x n squares of two triangles over 10 m x 10 m, with hills; u is that of all its vertices.
Sheet hills(std::uint32_t n, float u) {
  Sheet sheet;
  for (std::uint32_t y = 0; y <= n; ++y) {
    for (std::uint32_t x = 0; x <= n; ++x) {
      const float x_m = 10.0F * static_cast<float>(x) / static_cast<float>(n),
                  y_m = 10.0F * static_cast<float>(y) / static_cast<float>(n);
      sheet.positions.insert(sheet.positions.end(), {x_m, y_m, 0.5F * std::sin(x_m) * std::cos(y_m)});
      sheet.texture_uv.insert(sheet.texture_uv.end(), {u, 0.5F});
      if (x == n || y == n) continue;
      const std::uint32_t a = y * (n + 1) + x, b = a + n + 1;
      sheet.indices.insert(sheet.indices.end(), {a, a + 1, b + 1, a, b + 1, b});
    }
  }
  return sheet;
}

TEST(Coarse, ASurfaceInFewerTrianglesIsNearlyTheSame) {
  constexpr std::size_t kWanted = 5000;
  const Sheet sheet = hills(300, 0.5F);
  const std::vector<std::uint32_t> coarse = coarse_indices(sheet.surface(), kWanted);
  EXPECT_LE(coarse.size() / 3, 1.2 * kWanted);
  EXPECT_GE(coarse.size() / 3, kWanted / 3);
  Eigen::AlignedBox3f box;
  for (std::size_t i = 0; i < coarse.size(); i += 3) {
    ASSERT_EQ((std::set<std::uint32_t>{coarse[i], coarse[i + 1], coarse[i + 2]}).size(), 3U);
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_LT(coarse[i + k], sheet.positions.size() / 3);
      box.extend(sheet.at(coarse[i + k]));
    }
  }
  // What is lost is less than a cell, 10 m / 50, at each edge.
  EXPECT_NEAR(box.sizes().x(), 10, 0.4);
  EXPECT_NEAR(box.sizes().y(), 10, 0.4);
  EXPECT_NEAR(sheet.area(coarse) / sheet.area(sheet.indices), 1, 0.08);
}

TEST(Coarse, WhatIsFarApartInTheTextureIsNotJoined) {
  Sheet sheet = hills(100, 0.1F);
  const Sheet other = hills(100, 0.9F);  // at the same place
  const auto first = static_cast<std::uint32_t>(sheet.positions.size() / 3);
  sheet.positions.insert(sheet.positions.end(), other.positions.begin(), other.positions.end());
  sheet.texture_uv.insert(sheet.texture_uv.end(), other.texture_uv.begin(), other.texture_uv.end());
  for (const std::uint32_t index : other.indices) sheet.indices.push_back(first + index);
  const std::vector<std::uint32_t> coarse = coarse_indices(sheet.surface(), 2000);
  std::array<int, 2> triangles{};
  for (std::size_t i = 0; i < coarse.size(); i += 3) {
    const bool is_other = coarse[i] >= first;
    ++triangles[is_other ? 1 : 0];
    ASSERT_EQ(coarse[i + 1] >= first, is_other);
    ASSERT_EQ(coarse[i + 2] >= first, is_other);
  }
  EXPECT_GT(triangles[0], 300);
  EXPECT_EQ(triangles[0], triangles[1]);
}

TEST(Coarse, FewTrianglesStayAsTheyAre) {
  const Sheet sheet = hills(10, 0.5F);
  EXPECT_EQ(coarse_indices(sheet.surface(), 200), sheet.indices);
  EXPECT_TRUE(coarse_indices({}, 10).empty());
}

TEST(Coarse, AllInOnePlaceIsNothing) {
  Sheet sheet = hills(20, 0.5F);
  std::fill(sheet.positions.begin(), sheet.positions.end(), 3.0F);
  EXPECT_TRUE(coarse_indices(sheet.surface(), 10).empty());
}

}  // namespace
}  // namespace esim::studio
