#include "esim/motion/files/pose_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "esim/core/error.h"
#include "esim/core/inputs/used_files.h"

namespace esim::inline motion {

namespace {

constexpr std::string_view kBlanks = " \t\r\v\f";
constexpr std::size_t kColumns = 8;
constexpr std::array<std::string_view, kColumns> kColumnNames{"t", "x", "y", "z", "qx", "qy", "qz", "qw"};

struct Format {
  std::string_view name;
  std::string_view columns;
  bool commas;
  int stamp_decimals;  // one unit of the stamps is 10^stamp_decimals ns
};
constexpr Format kTum{"TUM", "t x y z qx qy qz qw, t in seconds, separated by spaces", false, 9};
constexpr Format kEsimCsv{"ESIM CSV", "t, x, y, z, qx, qy, qz, qw, t in nanoseconds, separated by commas", true, 0};

std::string_view trim(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::vector<std::string_view> split(std::string_view line, const Format& format) {
  std::vector<std::string_view> fields;
  if (format.commas) {
    for (std::size_t comma; (comma = line.find(',')) != std::string_view::npos; line.remove_prefix(comma + 1)) {
      fields.push_back(trim(line.substr(0, comma)));
    }
    fields.push_back(trim(line));
    return fields;
  }
  for (line = trim(line); !line.empty(); line = trim(line)) {
    const std::size_t length = std::min(line.find_first_of(kBlanks), line.size());
    fields.push_back(line.substr(0, length));
    line.remove_prefix(length);
  }
  return fields;
}

/// A complete field as a number; `from_chars` does not accept a leading plus.
template <typename T>
std::optional<T> parse_number(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  T value{};
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (status != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// The integer nearest to text · 10^decimals (halves away from zero), exactly. Empty for text that is not a decimal
/// number, and for values beyond ±146 years in nanoseconds, so that differences do not overflow.
std::optional<TimeNs> parse_stamp(std::string_view text, int decimals) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  int exponent = 0;
  if (const std::size_t e = text.find_first_of("eE"); e != std::string_view::npos) {
    const auto parsed = parse_number<int>(text.substr(e + 1));
    if (!parsed || std::abs(*parsed) > 1000) return std::nullopt;
    exponent = *parsed;
    text = text.substr(0, e);
  }
  // The value is 0.d₁d₂d₃… · 10^point.
  std::string digits;
  int point = exponent + decimals;
  bool fraction = false;
  for (const char c : text) {
    if (c == '.' && !fraction) {
      fraction = true;
    } else if (c >= '0' && c <= '9') {
      digits += c;
      if (!fraction) ++point;
    } else {
      return std::nullopt;
    }
  }
  if (digits.empty()) return std::nullopt;

  constexpr TimeNs kLargest = std::numeric_limits<TimeNs>::max() / 2;
  TimeNs value = 0;
  for (int i = 0; i < point; ++i) {
    const int digit = i < static_cast<int>(digits.size()) ? digits[static_cast<std::size_t>(i)] - '0' : 0;
    if (value > (kLargest - digit) / 10) return std::nullopt;
    value = 10 * value + digit;
  }
  const bool round_up =
      point >= 0 && point < static_cast<int>(digits.size()) && digits[static_cast<std::size_t>(point)] >= '5';
  if (round_up) ++value;
  return negative ? -value : value;
}

/// One pose of the file. `fail` throws the UserError that names the line.
template <typename Fail>
TimedPose parse_pose(std::string_view line, const Format& format, const Fail& fail) {
  const std::vector<std::string_view> fields = split(line, format);
  if (fields.size() != kColumns) {
    fail(fmt::format("{} column{} instead of {}; a {} file has {}", fields.size(), fields.size() == 1 ? "" : "s",
                     kColumns, format.name, format.columns));
  }
  const auto stamp = parse_stamp(fields[0], format.stamp_decimals);
  if (!stamp) fail(fmt::format("the stamp '{}' is not a decimal number in range; give {}", fields[0], format.columns));

  std::array<double, kColumns> values{};
  for (std::size_t i = 1; i < kColumns; ++i) {
    const auto value = parse_number<double>(fields[i]);
    if (!value || !std::isfinite(*value)) {
      fail(fmt::format("{} is '{}', not a finite number; correct or remove the line", kColumnNames[i], fields[i]));
    }
    values[i] = *value;
  }
  Eigen::Quaterniond rotation(values[7], values[4], values[5], values[6]);
  const double norm = rotation.coeffs().stableNorm();
  if (!(norm > 1e-6)) fail("the quaternion is zero; correct or remove the line (no rotation is 0 0 0 1)");
  rotation.coeffs() /= norm;
  return {*stamp, {rotation, {values[1], values[2], values[3]}}};
}

}  // namespace

std::vector<TimedPose> read_pose_text(const std::filesystem::path& path) {
  const std::string file = path.string();
  std::ifstream in = open_input(path);
  if (!in) throw UserError(fmt::format("{}: cannot open the trajectory: {}", file, std::strerror(errno)));

  std::vector<TimedPose> poses;
  std::vector<int> lines;  // of the poses, for messages
  std::optional<Format> format;
  std::string text;
  for (int line = 1; std::getline(in, text); ++line) {
    std::string_view content = text;
    if (line == 1 && content.starts_with("\xEF\xBB\xBF")) content.remove_prefix(3);  // byte order mark
    content = trim(content);
    if (content.empty() || content.front() == '#') continue;
    if (!format) format = content.find(',') != std::string_view::npos ? kEsimCsv : kTum;

    TimedPose pose = parse_pose(content, *format, [&](const std::string& message) {
      throw UserError(fmt::format("{}:{}: {}", file, line, message));
    });
    if (!poses.empty() && poses.back().T_world_body.rotation.dot(pose.T_world_body.rotation) < 0.0) {
      pose.T_world_body.rotation.coeffs() *= -1.0;
    }
    poses.push_back(pose);
    lines.push_back(line);
  }
  if (in.bad()) throw UserError(fmt::format("{}: cannot read the trajectory; is it a directory?", file));
  if (poses.size() < 2) {
    throw UserError(fmt::format("{}: {} pose{}, but a motion needs at least two; give lines of {} or {}", file,
                                poses.size(), poses.size() == 1 ? "" : "s", kTum.columns, kEsimCsv.columns));
  }
  if (const auto fault = find_stamp_fault(poses)) {
    throw UserError(fmt::format("{}:{}: {}", file, lines[fault->pose], fault->message));
  }
  return poses;
}

}  // namespace esim::inline motion
