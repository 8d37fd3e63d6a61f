#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "esim/files/codecs/zstandard.h"

namespace esim::test {

/// Bytes in the order of little-endian machines.
class ByteWriter {
 public:
  template <typename T>
  ByteWriter& put(T value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  template <typename T>
  ByteWriter& put_reversed(T value) {
    const std::string there = ByteWriter().put(value).bytes();
    bytes_.append(there.rbegin(), there.rend());
    return *this;
  }
  ByteWriter& text(const std::string& text) {
    bytes_ += text;
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

inline std::uint32_t crc32(const std::string& bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xEDB88320U : 0U);
  }
  return ~crc;
}

/// A gzip file of one block without compression, of fewer than 65536 bytes.
inline std::string gzip(const std::string& bytes) {
  const auto size = static_cast<std::uint16_t>(bytes.size());
  return ByteWriter()
      .text(std::string("\x1F\x8B\x08\0\0\0\0\0\0\xFF\x01", 11))
      .put(size)
      .put(static_cast<std::uint16_t>(~size))
      .text(bytes)
      .put(crc32(bytes))
      .put(static_cast<std::uint32_t>(bytes.size()))
      .bytes();
}

/// A zip of files without compression.
inline std::string zip(const std::map<std::string, std::string>& files) {
  ByteWriter out, list;
  for (const auto& [name, content] : files) {
    const auto at = static_cast<std::uint32_t>(out.bytes().size()), size = static_cast<std::uint32_t>(content.size());
    // Version, flags, method, time, date (1 January 1980), checksum, sizes, and lengths of the name and of extra data.
    ByteWriter head;
    head.put<std::uint16_t>(20).put<std::uint32_t>(0).put<std::uint16_t>(0).put<std::uint16_t>(33).put(crc32(content));
    head.put(size).put(size).put(static_cast<std::uint16_t>(name.size())).put<std::uint16_t>(0);
    out.text("PK\x03\x04").text(head.bytes()).text(name).text(content);
    list.text("PK\x01\x02").put<std::uint16_t>(20).text(head.bytes()).put<std::uint16_t>(0).put<std::uint32_t>(0);
    list.put<std::uint32_t>(0).put(at).text(name);
  }
  const auto count = static_cast<std::uint16_t>(files.size());
  ByteWriter end;
  end.text("PK\x05\x06").put<std::uint32_t>(0).put(count).put(count);
  end.put(static_cast<std::uint32_t>(list.bytes().size())).put(static_cast<std::uint32_t>(out.bytes().size()));
  return out.bytes() + list.bytes() + end.put<std::uint16_t>(0).bytes();
}

/// A lossless WebP of pixels R G B A, in rows.
inline std::string webp(int width, const std::vector<std::array<int, 4>>& pixels) {
  cv::Mat image(static_cast<int>(pixels.size()) / width, width, CV_8UC4);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto [r, g, b, a] = pixels[i];
    image.at<cv::Vec4b>(static_cast<int>(i) / width, static_cast<int>(i) % width) = {
        static_cast<std::uint8_t>(b), static_cast<std::uint8_t>(g), static_cast<std::uint8_t>(r),
        static_cast<std::uint8_t>(a)};
  }
  std::vector<std::uint8_t> bytes;
  cv::imencode(".webp", image, bytes, {cv::IMWRITE_WEBP_QUALITY, 101});  // above 100: lossless
  return {bytes.begin(), bytes.end()};
}

/// The value of coefficient k of a colour in the test's splats: different for all, and exact in the formats of few
/// bits.
inline float test_coefficient(int k, int colour) { return static_cast<float>(k * 3 + colour - 24) / 32; }

/// A PLY of one splat of the given degree, its properties in an unusual order, with others between them:
/// position (1 2 3), deviations (e⁻¹ e⁻² e⁻³), rotation w x y z (2 0 0 2), opacity 1/2.
inline std::string plain_ply(int degree, const std::string& comments = "") {
  std::vector<std::pair<std::string, float>> properties = {{"scale_0", -1.F}, {"scale_1", -2.F}, {"scale_2", -3.F},
                                                           {"unknown", 9.F},  {"z", 3.F},        {"y", 2.F},
                                                           {"x", 1.F},        {"opacity", 0.F}};
  const int rest = degree * (degree + 2);
  for (int colour = 0; colour < 3; ++colour) {
    properties.emplace_back("f_dc_" + std::to_string(colour), test_coefficient(0, colour));
    for (int k = 1; k <= rest; ++k)
      properties.emplace_back("f_rest_" + std::to_string(colour * rest + k - 1), test_coefficient(k, colour));
  }
  for (int i = 0; i < 4; ++i) properties.emplace_back("rot_" + std::to_string(i), i == 0 || i == 3 ? 2.F : 0.F);
  ByteWriter out;
  out.text("ply\nformat binary_little_endian 1.0\n" + comments + "element vertex 1\n");
  for (const auto& [name, value] : properties) out.text("property float " + name + "\n");
  out.text("end_header\n");
  for (const auto& [name, value] : properties) out.put(value);
  return out.bytes();
}

/// A compressed PLY of two splats, with harmonics of the given degree. Positions: the low and the high limit of the
/// chunk, (-1 -2 -4) and (1 2 4). Both have deviations e⁻¹, the rotation x y z w (0 0 0 1), colour (1 0 0), opacity
/// 1/5.
inline std::string compressed_ply(int degree) {
  ByteWriter out;
  out.text("ply\nformat binary_little_endian 1.0\nelement chunk 1\n");
  for (const char* const kind : {"", "scale_"}) {
    for (const char* const limit : {"min_", "max_"}) {
      for (const char* const axis : {"x", "y", "z"})
        out.text(std::string("property float ") + limit + kind + axis + "\n");
    }
  }
  out.text("element vertex 2\n");
  for (const char* const name : {"position", "rotation", "scale", "color"})
    out.text(std::string("property uint packed_") + name + "\n");
  const int rest = degree * (degree + 2);
  if (rest > 0) out.text("element sh 2\n");
  for (int i = 0; i < 3 * rest; ++i) out.text("property uchar f_rest_" + std::to_string(i) + "\n");
  out.text("end_header\n");
  for (const float limit : {-1.F, -2.F, -4.F, 1.F, 2.F, 4.F, -1.F, -1.F, -1.F, -1.F, -1.F, -1.F}) out.put(limit);
  // The components left out are 0 = 511.5 / 1023 - 0.5, up to rounding.
  constexpr std::uint32_t kIdentity = 512U << 20 | 512U << 10 | 512U, kRed = 255U << 24 | 51U;
  out.put<std::uint32_t>(0).put(kIdentity).put<std::uint32_t>(0).put(kRed);
  out.put<std::uint32_t>(0xFFFFFFFF).put(kIdentity).put<std::uint32_t>(0).put(kRed);
  for (int splat = 0; splat < 2; ++splat) {
    for (int i = 0; i < 3 * rest; ++i) out.put(static_cast<std::uint8_t>(128 + 4 * splat + i));
  }
  return out.bytes();
}

/// A .splat of one splat: position (1 2 3), deviations (0.1 0.2 0.3), colour (1 0 0.2), opacity 0.4, and a rotation by
/// 90 degrees around x.
inline std::string dot_splat() {
  ByteWriter out;
  for (const float value : {1.F, 2.F, 3.F, 0.1F, 0.2F, 0.3F}) out.put(value);
  for (const int value : {255, 0, 51, 102, 218, 218, 128, 128}) out.put(static_cast<std::uint8_t>(value));
  return out.bytes();
}

/// The streams of an .spz of one splat, as in its file: position (1 2 -3) right, up, back; opacity 0.2; colour
/// (1 0 0.2) up to its factor; deviations e⁻¹ e⁻² e⁻³; a rotation of 90 degrees around (right, up, back) z.
inline std::vector<std::string> spz_streams(int version, int degree) {
  std::vector<std::string> streams;
  ByteWriter positions, harmonics;
  if (version == 1) {
    for (const int half : {0x3C00, 0x4000, 0xC200}) positions.put(static_cast<std::uint16_t>(half));
  } else {
    for (const int value : {1, 2, -3}) positions.text(ByteWriter().put(value * 4096).bytes().substr(0, 3));
  }
  for (int k = 1; k <= degree * (degree + 2); ++k) {
    for (int colour = 0; colour < 3; ++colour)
      harmonics.put(static_cast<std::uint8_t>(128 + (k < 16 ? std::lround(128 * test_coefficient(k, colour)) : 0)));
  }
  // sqrt(1/2) = 511 / 511 sqrt(1/2): z, in the lowest 10 bits, and w is left out.
  const std::string rotation = version < 3 ? std::string("\x80\x80\xDA") : ByteWriter().put(3U << 30 | 511U).bytes();
  return {positions.bytes(), std::string("\x33"), std::string("\xFF\x00\x33", 3), std::string("\x90\x80\x70"),
          rotation,          harmonics.bytes()};
}

inline std::string spz_header(std::uint32_t version, std::uint32_t count, int degree, int flags, int streams = 0) {
  ByteWriter out;
  out.text("NGSP").put(version).put(count);
  for (const int value : {degree, 12, flags, streams}) out.put(static_cast<std::uint8_t>(value));
  return out.bytes();
}

/// An .spz of the splat of spz_streams(), with the given extension records.
inline std::string spz(int version, int degree, int flags = 0, const std::string& extensions = "") {
  const std::vector<std::string> streams = spz_streams(version, degree);
  if (version < 4) {
    std::string all = spz_header(static_cast<std::uint32_t>(version), 1, degree, flags);
    for (const std::string& stream : streams) all += stream;
    return gzip(all + extensions);
  }
  const int count = degree > 0 ? 6 : 5;
  ByteWriter out, data;
  out.text(spz_header(4, 1, degree, flags, count)).put(static_cast<std::uint32_t>(32 + extensions.size()));
  out.text(std::string(12, '\0')).text(extensions);
  for (int i = 0; i < count; ++i) {
    const std::string& stream = streams[static_cast<std::size_t>(i)];
    std::string frame;
    compress_zstandard(stream, 1, frame);
    out.put<std::uint64_t>(frame.size()).put<std::uint64_t>(stream.size());
    data.text(frame);
  }
  return out.bytes() + data.bytes();
}

/// The files of a .sog of two splats: positions (0 0 0) and (1 2 -3); deviations e⁻¹ e⁻² e⁻³; rotations of 90 degrees
/// around x and of none; harmonics of degree 0 of -1, 0 and 1; opacity 0.2,
/// or 1/2 in version 1; those of higher degrees are those of entries
/// 65 and 0 of the palette, of which the bytes are 10 k + colour, and 1 / 100 of that as numbers.
inline std::map<std::string, std::string> sog_files(int version, int degree) {
  using Pixels = std::vector<std::array<int, 4>>;
  nlohmann::json meta;
  // The limits of sign(x) ln(|x| + 1): the second splat is at the high ones, the first in the middle.
  const std::vector<double> high = {std::log(2), std::log(3), -std::log(4)};
  meta["means"] = {
      {"mins", {-high[0], -high[1], -high[2]}}, {"maxs", high}, {"files", {"means_l.webp", "means_u.webp"}}};
  meta["scales"] = {{"files", {"scales.webp"}}};
  meta["quats"] = {{"files", {"quats.webp"}}};
  meta["sh0"] = {{"files", {"sh0.webp"}}};
  std::vector<double> book(256);
  for (std::size_t i = 0; i < book.size(); ++i) book[i] = static_cast<double>(i) / 100;
  if (version == 2) {
    meta["version"] = 2;
    meta["count"] = 2;
    meta["scales"]["codebook"] = {-3, -2, -1};
    meta["sh0"]["codebook"] = {-1, 0, 1};
  } else {
    meta["means"]["shape"] = {2, 3};
    meta["scales"]["mins"] = {0, 0, 0};
    meta["scales"]["maxs"] = {-255, -255, -255};
    meta["sh0"]["mins"] = {-1, -1, -1, -51};
    meta["sh0"]["maxs"] = {254, 254, 254, 204};
  }
  std::map<std::string, std::string> files;
  files["means_l.webp"] = webp(2, Pixels{{255, 255, 255, 255}, {255, 255, 255, 255}});
  files["means_u.webp"] = webp(2, Pixels{{127, 127, 127, 255}, {255, 255, 255, 255}});
  const std::array<int, 4> scale = version == 2 ? std::array{2, 1, 0, 255} : std::array{1, 2, 3, 255};
  files["scales.webp"] = webp(2, Pixels{scale, scale});
  files["quats.webp"] = webp(2, Pixels{{255, 128, 128, 252}, {128, 128, 128, 252}});
  files["sh0.webp"] = webp(2, Pixels{{0, 1, 2, 51}, {0, 1, 2, 51}});
  if (degree > 0) {
    meta["shN"] = {{"files", {"centroids.webp", "labels.webp"}}};
    if (version == 2) {
      meta["shN"]["bands"] = degree;
      meta["shN"]["count"] = 66;
      meta["shN"]["codebook"] = book;
    } else {
      meta["shN"]["mins"] = 0;
      meta["shN"]["maxs"] = 2.55;
    }
    const int rest = degree * (degree + 2), width = 64 * rest;
    Pixels palette(static_cast<std::size_t>(2 * width), {0, 0, 0, 255});
    for (int k = 1; k <= rest; ++k)
      palette[static_cast<std::size_t>(width + rest + k - 1)] = {10 * k, 10 * k + 1, 10 * k + 2, 255};
    files["centroids.webp"] = webp(width, palette);
    files["labels.webp"] = webp(2, Pixels{{65, 0, 0, 255}, {0, 0, 0, 255}});
  }
  files["meta.json"] = meta.dump();
  return files;
}

}  // namespace esim::test
