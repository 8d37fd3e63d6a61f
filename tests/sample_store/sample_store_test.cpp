#include "esim/sample_store/sample_store.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

#include "esim/core/error.h"
#include "esim/core/random.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

constexpr int kWidth = 70, kHeight = 50;

/// Segments with their own memory.
struct Portion {
  std::vector<Segment> segments;
  TimeNs watermark = 0;
  std::vector<std::vector<float>> memory{};
};

/// Irradiance of all magnitudes, that changes little or much.
float random_irradiance(std::uint32_t item, std::uint64_t draw) {
  const auto u = AddressedRandom(3, Purpose::test).uniforms(item, draw);
  if (u[1] < 0.02) return 0;
  if (u[1] < 0.04) return static_cast<float>(std::pow(10, 40 * u[0] - 30));
  return static_cast<float>(0.3 + 0.3 * std::sin(item) + 0.01 * u[0]);
}

/// Portions of the segments of two tiles, side by side, which have samples at different times, `step` ns apart.
std::vector<Portion> make_portions(int count, TimeNs step = 1000) {
  const std::array<Tile, 2> tiles{Tile{0, 0, 33, kHeight}, Tile{33, 0, kWidth - 33, kHeight}};
  std::array<TimeNs, 2> done{};
  std::array<std::vector<float>, 2> latest;
  std::vector<Portion> portions;
  for (int i = 0; i < count; ++i) {
    Portion portion;
    portion.watermark = step * i;
    const int segments = i % 4 == 3 ? 0 : 1 + i % 3;
    for (int k = 0; k < segments; ++k) {
      const std::size_t which = static_cast<std::size_t>(i + k) % 2;
      const Tile& tile = tiles[which];
      std::vector<float>& now = portion.memory.emplace_back(tile.area());
      for (std::size_t p = 0; p < now.size(); ++p)
        now[p] = random_irradiance(static_cast<std::uint32_t>(p), static_cast<std::uint64_t>(100 * i + k));
      const bool begins = latest[which].empty();
      std::vector<float> before = begins ? now : latest[which];
      if (i == 7) before[5] += 1;  // starts elsewhere
      const TimeNs t1 = begins ? 0 : step * i + k + 1;
      latest[which] = now;
      portion.memory.push_back(std::move(before));
      portion.segments.push_back({tile, begins ? 0 : done[which], t1, {}, {}});
      done[which] = t1;
    }
    for (std::size_t k = 0; k < portion.segments.size(); ++k) {
      Segment& segment = portion.segments[k];
      segment.irradiance1 = {portion.memory[2 * k].data(), segment.tile};
      segment.irradiance0 = {portion.memory[2 * k + 1].data(), segment.tile};
    }
    portions.push_back(std::move(portion));
  }
  return portions;
}

class SampleStore : public testing::TestWithParam<SamplePrecision> {
 protected:
  std::filesystem::path file() const { return folder_.path() / "samples.esim"; }

  void write(const std::vector<Portion>& portions, int threads = 2, bool finish = true, TimeNs end = 1'000'000) {
    const Workers workers(threads);
    SampleStoreWriter writer(file(), {kWidth, kHeight, 0, end, GetParam()});
    for (const Portion& portion : portions) writer.add(portion.segments, portion.watermark, workers);
    if (finish) writer.finish(workers);
  }
  std::string bytes() const {
    std::ifstream stream(file(), std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void write_bytes(const std::string& bytes) { std::ofstream(file(), std::ios::binary) << bytes; }

  /// Reads everything; the error, or kNoError.
  static constexpr const char* kNoError = "nothing was thrown";
  std::string read_all() {
    return test::message_of<UserError>([&] {
      SampleStoreReader reader(file());
      while (reader.next(workers_) != nullptr) continue;
    });
  }

  test::TemporaryDirectory folder_;
  Workers workers_{3};
};

TEST_P(SampleStore, GivesBackWhatItWasTold) {
  const std::vector<Portion> portions = make_portions(200);
  write(portions);
  SampleStoreReader reader(file());
  EXPECT_EQ(reader.info().width, kWidth);
  EXPECT_EQ(reader.info().end, 1'000'000);
  EXPECT_EQ(reader.info().precision, GetParam());
  const bool exact = GetParam() == SamplePrecision::exact;
  double largest = 0;
  const auto compare = [&](const ImageView<float>& read, const ImageView<float>& given, const Tile& tile) {
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      for (int x = tile.x; x < tile.x + tile.width; ++x) {
        if (exact) {
          ASSERT_EQ(std::bit_cast<std::uint32_t>(read(x, y)), std::bit_cast<std::uint32_t>(given(x, y)));
        } else if (given(x, y) == 0) {
          ASSERT_EQ(read(x, y), 0);
        } else {
          largest = std::max(largest, std::fabs(std::log(double{read(x, y)} / double{given(x, y)})));
        }
      }
    }
  };
  // The store divides portions where its blocks end; the parts keep the earlier watermark.
  std::size_t portion = 0, segment = 0, read_segments = 0;
  TimeNs watermark = std::numeric_limits<TimeNs>::min();
  while (const auto* const read = reader.next(workers_)) {
    for (const Segment& r : read->segments) {
      while (segment == portions[portion].segments.size()) ++portion, segment = 0;
      const Segment& g = portions[portion].segments[segment++];
      ++read_segments;
      ASSERT_EQ(r.tile, g.tile);
      ASSERT_EQ(r.t0, g.t0);
      ASSERT_EQ(r.t1, g.t1);
      compare(r.irradiance1, g.irradiance1, g.tile);
      compare(r.irradiance0, g.irradiance0, g.tile);
    }
    EXPECT_GE(read->watermark, watermark);
    EXPECT_LE(read->watermark, portions[portion].watermark + 2000);
    watermark = read->watermark;
  }
  EXPECT_EQ(watermark, portions.back().watermark);
  std::size_t all = 0;
  for (const Portion& each : portions) all += each.segments.size();
  EXPECT_EQ(read_segments, all);
  EXPECT_LE(largest, kMaxRoundingError);
  if (!exact) {
    EXPECT_GT(largest, kMaxRoundingError / 4);
  }
  EXPECT_EQ(reader.next(workers_), nullptr);
}

TEST_P(SampleStore, HasTheSameBytesWithAnyNumberOfThreads) {
  const std::vector<Portion> portions = make_portions(50);
  write(portions, 1);
  const std::string one = bytes();
  write(portions, 4);
  EXPECT_EQ(bytes(), one);
}

/// A segment as it was read, with the bits of its irradiance.
struct ReadSegment {
  Tile tile;
  TimeNs t0 = 0, t1 = 0;
  std::vector<std::uint32_t> bits;
  bool operator==(const ReadSegment&) const = default;
};

std::vector<ReadSegment> rest_of(SampleStoreReader& reader) {
  const Workers workers(2);
  std::vector<ReadSegment> all;
  while (const auto* const portion = reader.next(workers)) {
    for (const Segment& segment : portion->segments) {
      ReadSegment& read = all.emplace_back(ReadSegment{segment.tile, segment.t0, segment.t1, {}});
      for (const ImageView<float>& image : {segment.irradiance0, segment.irradiance1}) {
        for (int y = segment.tile.y; y < segment.tile.y + segment.tile.height; ++y) {
          for (int x = segment.tile.x; x < segment.tile.x + segment.tile.width; ++x)
            read.bits.push_back(std::bit_cast<std::uint32_t>(image(x, y)));
        }
      }
    }
  }
  return all;
}

TEST_P(SampleStore, BeginsWhereRequested) {
  constexpr TimeNs kStep = 5 * kNsPerMs, kEnd = 8 * kNsPerSecond;
  write(make_portions(1400, kStep), 2, true, kEnd);
  SampleStoreReader complete(file());
  const std::vector<ReadSegment> all = rest_of(complete);
  std::size_t most_left_out = 0;
  for (const TimeNs t :
       {TimeNs{-5}, TimeNs{0}, kNsPerSecond, 2 * kNsPerSecond, 3'141'592'653, 6 * kNsPerSecond, kEnd}) {
    SampleStoreReader reader(file(), t % 2 == 0);
    reader.seek(t);
    const std::vector<ReadSegment> rest = rest_of(reader);
    ASSERT_LE(rest.size(), all.size());
    const std::size_t left_out = all.size() - rest.size();
    EXPECT_TRUE(std::equal(rest.begin(), rest.end(), all.begin() + static_cast<std::ptrdiff_t>(left_out))) << t;
    for (std::size_t i = 0; i < left_out; ++i) ASSERT_LE(all[i].t1, t + kStep + 3);  // tiles are ahead by a portion
    // Key blocks follow each other after half a second, plus the block that is not yet full, which has 1.5 s here.
    EXPECT_GE(all[left_out].t0 + 3 * kNsPerSecond, std::min(t, all.back().t0));
    most_left_out = std::max(most_left_out, left_out);
  }
  EXPECT_GT(most_left_out, all.size() / 2);
}

TEST_P(SampleStore, BeginsOnlyInCompleteStores) {
  const auto sought = [&] {
    return test::message_of<UserError>([&] {
      SampleStoreReader reader(file());
      reader.seek(3 * kNsPerSecond);
      while (reader.next(workers_) != nullptr) continue;
    });
  };
  const std::vector<Portion> portions = make_portions(400, 10 * kNsPerMs);
  write(portions, 2, true, 8 * kNsPerSecond);
  const std::string good = bytes();
  EXPECT_EQ(sought(), kNoError);
  for (std::size_t missing = 1; missing < 200; ++missing) {
    write_bytes(good.substr(0, good.size() - missing));
    EXPECT_TRUE(test::contains(sought(), "cannot read")) << missing;
  }
  for (std::size_t at = good.size() - 100; at < good.size(); ++at) {
    std::string damaged = good;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x5a);
    write_bytes(damaged);
    sought();  // reads or refuses
  }
  write(portions, 2, false, 8 * kNsPerSecond);
  EXPECT_TRUE(test::contains(sought(), "their recording was interrupted"));
}

TEST_P(SampleStore, MayBeEmpty) {
  write({});
  EXPECT_EQ(read_all(), kNoError);
}

TEST_P(SampleStore, RefusesOtherFilesVersionsAndSizes) {
  write(make_portions(3));
  const std::string good = bytes();
  write_bytes("0.1 2 3 1\n");
  EXPECT_TRUE(test::contains(read_all(), "it is not a store of samples"));
  write_bytes("");
  EXPECT_TRUE(test::contains(read_all(), "it is not a store of samples"));
  std::string other = good;
  other[8] = 9;
  write_bytes(other);
  EXPECT_TRUE(test::contains(read_all(), "its version is 9, but this esim reads version 2; simulate again"));
  other = good;
  std::memset(other.data() + 16, 0xff, 4);
  write_bytes(other);
  EXPECT_TRUE(test::contains(read_all(), "its size, -1 x 50 px, is invalid"));
  other = good;
  other[16] = 40;  // narrower than its tiles
  write_bytes(other);
  EXPECT_TRUE(test::contains(read_all(), "a tile is outside the image"));
  write_bytes(good + "more");
  EXPECT_TRUE(test::contains(read_all(), "more follows the end"));
}

TEST_P(SampleStore, NoticesWhereItIsCut) {
  write(make_portions(12), 1);
  const std::string good = bytes();
  for (std::size_t size = 0; size < good.size(); size += 1 + good.size() / 97) {
    write_bytes(good.substr(0, size));
    EXPECT_NE(read_all(), kNoError) << size;
  }
  write(make_portions(200), 1, false);
  EXPECT_TRUE(test::contains(read_all(), "the file ends within the samples: their recording was interrupted"));
}

TEST_P(SampleStore, SurvivesDamageAtAnyByte) {
  write(make_portions(12), 1);
  const std::string good = bytes();
  int noticed = 0;
  for (std::size_t at = 40; at < good.size(); at += 1 + good.size() / 701) {
    std::string damaged = good;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x5a);
    write_bytes(damaged);
    noticed += read_all() != kNoError;
  }
  EXPECT_GT(noticed, 650) << "all but reserved bytes";
}

INSTANTIATE_TEST_SUITE_P(Precisions, SampleStore, testing::Values(SamplePrecision::exact, SamplePrecision::rounded),
                         [](const auto& precision) {
                           return precision.param == SamplePrecision::exact ? "exact" : "rounded";
                         });

}  // namespace
}  // namespace esim
