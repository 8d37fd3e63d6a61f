#include "esim/formats/jaer/header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <utility>

#include "esim/core/error.h"
#include "esim/core/remedy.h"

namespace esim::inline formats::jaer {
namespace {

constexpr std::size_t kMaxLineBytes = 1 << 16, kMaxNameBytes = 100;
constexpr std::string_view kVersion = "2.0", kChipKey = "AEChip:", kSensorKey = "Sensor:";

/// Classes of jAER by the number in their names. The first of each size is written.
struct Class {
  std::string_view number, name;
  SensorSize sensor;
};
constexpr std::array kClasses = {
    Class{"346", "Davis346red", {346, 260}}, Class{"240", "DAVIS240C", {240, 180}},
    Class{"640", "Davis640", {640, 480}},    Class{"208", "Davis208PixelParade", {208, 192}},
    Class{"128", "Davis128", {128, 128}},
};
constexpr std::string_view kPackage = "eu.seebetter.ini.chips.davis.";
constexpr SensorSize kDvs128{128, 128};

struct Header {
  std::string chip{};                  // empty: not stated
  std::optional<SensorSize> sensor{};  // of the line that davis_header() writes
};

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string in_small_letters(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

/// "346 x 260 px"
std::optional<SensorSize> parse_size(std::string_view text) {
  SensorSize size;
  const char* const end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size.width);
  constexpr std::string_view kBetween = " x ";
  if (width.ec != std::errc() || !std::string_view(width.ptr, end).starts_with(kBetween)) return std::nullopt;
  if (std::from_chars(width.ptr + kBetween.size(), end, size.height).ec != std::errc()) return std::nullopt;
  if (size.width < 1 || size.height < 1 || size.width > kMaxDavisWidth || size.height > kMaxDavisHeight)
    return std::nullopt;
  return size;
}

/// Events are no text: the last byte of the address of the first one is 0, if its first byte is a '#'.
bool is_text(std::string_view line) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  return std::none_of(line.begin(), line.end(), [](unsigned char c) { return c < ' ' && c != '\t'; });
}

/// A name from the file, for messages.
std::string shown(std::string_view name) {
  std::string text(name.substr(0, kMaxNameBytes));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

bool ends_header(std::string_view line) {
  const std::string text = in_small_letters(trimmed(line.substr(1)));
  return text == "end of ascii header";
}

void take_line(std::string_view line, Header& header) {
  std::string_view text = trimmed(line.substr(1));
  if (text.starts_with(kChipKey)) header.chip = shown(trimmed(text.substr(kChipKey.size())));
  if (text.starts_with(kSensorKey)) header.sensor = parse_size(trimmed(text.substr(kSensorKey.size())));
}

/// Takes the complete lines of a block of the file. Returns how many bytes they have, and whether the header goes on.
std::pair<std::size_t, bool> take_lines(std::string_view block, Header& header) {
  std::size_t used = 0;
  while (used < block.size()) {
    const std::string_view rest = block.substr(used);
    const std::size_t end = rest.find('\n');
    const std::string_view line = rest.substr(0, end);
    if (line.front() != '#' || !is_text(line)) return {used, false};
    if (end == std::string_view::npos) return {used, true};
    used += end + 1;
    if (ends_header(line)) return {used, false};
    take_line(line, header);
  }
  return {used, true};
}

void check_version(const InputFile& file, std::string_view line) {
  const std::string_view version = trimmed(line.substr(std::min(kSignature.size(), line.size())));
  if (version == kVersion) return;
  file.fail(
      0, fmt::format("version \"{}\" of AEDAT is not supported, only 2.0 and 4.0; convert the file with iniVation's DV",
                     shown(version)));
}

Header read_lines(InputFile& file) {
  Header header;
  check_version(file, file.read_line(kMaxLineBytes, "the first line"));
  for (bool goes_on = true; goes_on;) {
    const std::uint64_t start = file.offset();
    const std::span<const std::byte> bytes = file.read(kMaxLineBytes);
    if (bytes.empty()) break;
    const auto [used, more] = take_lines({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, header);
    if (more && used == 0) {
      if (bytes.size() == kMaxLineBytes) file.fail(start, "the line of the header is too long");
      file.fail(start + bytes.size(), "the file ends within the header");
    }
    goes_on = more;
    if (used < bytes.size()) file.seek(start + used);
  }
  return header;
}

bool equal(SensorSize a, SensorSize b) { return a.width == b.width && a.height == b.height; }

[[noreturn]] void ask_for_size(const InputFile& file, std::string_view problem) {
  throw RemediableError(fmt::format("cannot read {}: {}: state it", file.path().string(), problem),
                        Remedy::sensor_size);
}

/// The chip that follows from the size of the sensor alone.
Chip chip_of_size(const InputFile& file, const std::optional<SensorSize>& stated) {
  constexpr std::string_view kSizes = "DVS128: 128 x 128 px; DAVIS: 240 x 180 or 346 x 260 px";
  if (!stated) {
    ask_for_size(file,
                 fmt::format("the header names no chip (AEChip), so that the layout of the addresses follows only "
                             "from the size of the sensor ({})",
                             kSizes));
  }
  if (equal(*stated, kDvs128)) return {Layout::dvs128, kDvs128};
  if (equal(*stated, kClasses[0].sensor) || equal(*stated, kClasses[1].sensor)) return {Layout::davis, *stated};
  throw UserError(
      fmt::format("cannot read {}: the header names no chip (AEChip), and a sensor of {} x {} px does not "
                  "determine the layout of the addresses; the size must be one of: {}",
                  file.path().string(), stated->width, stated->height, kSizes));
}

}  // namespace

Chip read_header(InputFile& file, const std::optional<SensorSize>& stated) {
  const Header header = read_lines(file);
  if (header.sensor) return {Layout::davis, *header.sensor};
  if (header.chip.empty()) return chip_of_size(file, stated);
  const std::string chip = in_small_letters(header.chip);
  const std::string_view name = std::string_view(chip).substr(chip.rfind('.') + 1);
  if (name.find("dvs128") != std::string_view::npos) return {Layout::dvs128, kDvs128};
  if (chip.find("davi") == std::string::npos) {
    throw UserError(
        fmt::format("cannot read {}: the addresses of chip \"{}\" are not supported, only those of DAVIS and "
                    "DVS128; convert the file with jAER",
                    file.path().string(), header.chip));
  }
  for (const Class& known : kClasses) {
    if (name.find(known.number) != std::string_view::npos) return {Layout::davis, known.sensor};
  }
  if (!stated) ask_for_size(file, fmt::format("the size of the sensor of chip \"{}\" is unknown", header.chip));
  return {Layout::davis, *stated};
}

// No date, so that the same recording gives the same bytes.
std::string davis_header(SensorSize sensor) {
  std::string text = fmt::format(
      "{}{}\r\n# Written by esim\r\n"
      "# Each event: address and time in us, 32 bits each, big-endian\r\n"
      "# Address: y << 22 | x << 12 | polarity << 11, from the lower right corner\r\n"
      "# {} {} x {} px\r\n",
      kSignature, kVersion, kSensorKey, sensor.width, sensor.height);
  for (const Class& known : kClasses) {
    if (equal(known.sensor, sensor)) text += fmt::format("# {} {}{}\r\n", kChipKey, kPackage, known.name);
  }
  return text + "#End Of ASCII Header\r\n";
}

}  // namespace esim::inline formats::jaer
