#include "esim/studio/recordings/event_store.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <numeric>
#include <random>

#include "support/temporary_directory.h"

namespace esim::studio {
namespace {

namespace fs = std::filesystem;

/// Events of 3 s, more and more of them.
std::vector<Event> some_events() {
  std::mt19937 random(1);
  std::vector<Event> events;
  for (TimeNs t = 5 * kNsPerMs; t < 3 * kNsPerSecond; t += 1 + static_cast<TimeNs>(random() % 200'000)) {
    events.push_back({t / kNsPerUs * kNsPerUs, static_cast<std::uint16_t>(random() % 64),
                      static_cast<std::uint16_t>(random() % 48), static_cast<std::int8_t>(random() % 3 == 0 ? -1 : 1)});
  }
  return events;
}

/// A file of events from `start` on.
void write_events(const fs::path& file, const std::vector<Event>& events, TimeNs start, TimeNs end) {
  EventsHdf5Writer writer(file, 0);
  RecordingInfo info;
  info.cameras.resize(1);
  info.cameras[0].model.width = 64, info.cameras[0].model.height = 48;
  info.start = start, info.end = end;
  writer.begin(info);
  writer.write(EventsRecord{0, events});
  writer.end(true);
}

std::uint64_t all_in(const EventRate& rate) {
  return std::accumulate(rate.on.begin(), rate.on.end(), std::uint64_t{0}) +
         std::accumulate(rate.off.begin(), rate.off.end(), std::uint64_t{0});
}

class EventStoreTest : public testing::Test {
 protected:
  EventStoreTest() : file_(directory_.path() / "events.h5") { write_events(file_, events_, 0, 3 * kNsPerSecond); }

  std::vector<Event> events_ = some_events();
  test::TemporaryDirectory directory_;
  fs::path file_;
};

TEST_F(EventStoreTest, FilesAndMemorySayTheSame) {
  const auto file = store_of(EventsHdf5Reader(file_));
  const auto memory = store_of(events_);
  ASSERT_EQ(file->size(), memory->size());
  for (const TimeNs t : {TimeNs{0}, 5 * kNsPerMs, kNsPerSecond, 2 * kNsPerSecond + 123'000, 4 * kNsPerSecond}) {
    const auto a = file->find(t, t + kNsPerMs), b = memory->find(t, t + kNsPerMs);
    EXPECT_EQ(a.first, b.first);
    EXPECT_EQ(a.end, b.end);
    EXPECT_EQ(file->read(a.first, 10), memory->read(b.first, 10));
  }
}

TEST_F(EventStoreTest, RatesCountEveryEventOnce) {
  const auto file = store_of(EventsHdf5Reader(file_));
  const auto memory = store_of(events_);
  for (const std::size_t bins : {1U, 3U, 300U, 7000U}) {
    const EventRate a = file->rate(0, 3 * kNsPerSecond, bins), b = memory->rate(0, 3 * kNsPerSecond, bins);
    EXPECT_EQ(all_in(a), events_.size());
    EXPECT_LE(a.on.size(), bins);
    EXPECT_EQ(a.edges, b.edges) << bins;
    EXPECT_EQ(a.on, b.on) << bins;  // by the index, or counted one by one
    EXPECT_EQ(a.off, b.off) << bins;
  }
}

TEST_F(EventStoreTest, TheWholeOfARecordingCountsAllOfItsEvents) {
  const auto file = store_of(EventsHdf5Reader(file_));
  for (const std::size_t bins : {2U, 100U, 5000U}) {
    const EventRate rate = file->rate(events_.front().t, events_.back().t + 1, bins);
    EXPECT_EQ(all_in(rate), events_.size()) << bins;
  }
}

TEST_F(EventStoreTest, RatesOfAPartCountItsEventsExactly) {
  const auto file = store_of(EventsHdf5Reader(file_));
  const auto memory = store_of(events_);
  for (const TimeNs from : {TimeNs{0}, 7 * kNsPerMs + 123'457, kNsPerSecond + 1}) {
    for (const TimeNs to : {2 * kNsPerSecond, 2 * kNsPerSecond + 765'432, 5 * kNsPerSecond}) {
      const EventRate a = file->rate(from, to, 90), b = memory->rate(from, to, 90);
      const auto range = memory->find(from, to);
      EXPECT_EQ(all_in(a), range.end - range.first);
      EXPECT_EQ(a.on, b.on) << from << " to " << to;
      EXPECT_EQ(a.off, b.off) << from << " to " << to;
    }
  }
}

TEST(EventRates, AConstantRateIsConstantInEveryBin) {
  const test::TemporaryDirectory directory;
  // 5 s in 800 bins would be 6.25 ms each, 1 ms 1.25 us: neither ms nor us fit into these alike.
  for (const auto& [every, length] : {std::pair(100 * kNsPerUs, 5 * kNsPerSecond), {kNsPerUs, kNsPerMs}}) {
    for (const TimeNs start : {TimeNs{0}, 12'345'678 * kNsPerUs}) {
      std::vector<Event> events;
      for (TimeNs t = start; t < start + length; t += every) events.push_back({t, 1, 1, 1});
      const fs::path file = directory.path() / "even.h5";
      write_events(file, events, start, start + length);
      for (const auto& store : {store_of(EventsHdf5Reader(file)), store_of(events)}) {
        const EventRate rate = store->rate(start, start + length, 800);
        ASSERT_GT(rate.on.size(), 300U);
        for (std::size_t i = 0; i < rate.on.size(); ++i) {
          const auto width = static_cast<double>(rate.edges[i + 1] - rate.edges[i]);
          const double expected = width / static_cast<double>(every);
          EXPECT_NEAR(static_cast<double>(rate.on[i]), expected, i == 0 || i + 1 == rate.on.size() ? 1.0 : 1e-9) << i;
        }
      }
    }
  }
}

TEST(EventRates, EdgesCoverTheSpanInWholeUnits) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 3000; ++i) {
    const auto upTo = [&](TimeNs limit) { return static_cast<TimeNs>(random() % static_cast<std::uint64_t>(limit)); };
    const TimeNs unit = i % 2 == 0 ? kNsPerMs : kNsPerUs, origin = upTo(kNsPerSecond) - kNsPerSecond / 2;
    const TimeNs from = upTo(10 * kNsPerSecond) - 5 * kNsPerSecond, to = from + 1 + upTo(2000 * unit);
    const std::size_t max = 1 + static_cast<std::size_t>(random() % 50);
    const std::vector<TimeNs> edges = bin_edges(from, to, max, unit, origin);
    ASSERT_GE(edges.size(), 2U);
    ASSERT_LE(edges.size(), max + 1);
    EXPECT_EQ(edges.front(), from);
    EXPECT_EQ(edges.back(), to);
    if (edges.size() < 4) continue;
    const TimeNs width = edges[2] - edges[1];
    EXPECT_EQ(width % unit, 0);
    for (std::size_t k = 1; k + 1 < edges.size(); ++k) {
      EXPECT_EQ((edges[k] - origin) % width, 0);
      EXPECT_TRUE(k == 1 || edges[k] - edges[k - 1] == width);
    }
    for (const TimeNs end : {edges[1] - from, to - edges[edges.size() - 2]}) {
      EXPECT_GE(2 * end, width - 1);
      EXPECT_LE(2 * end, 3 * width + 1);
    }
  }
}

TEST_F(EventStoreTest, ThinnedEventsAreSpreadEvenly) {
  const auto store = store_of(events_);
  const auto kept = store->thinned({0, events_.size()}, 100);
  ASSERT_EQ(kept.size(), 100U);
  for (std::size_t i = 1; i < kept.size(); ++i) EXPECT_GT(kept[i].t, kept[i - 1].t);
  EXPECT_LT(kept.front().t, events_[events_.size() / 90].t);
  EXPECT_GT(kept.back().t, events_[events_.size() * 98 / 100].t);
  EXPECT_EQ(store->thinned({5, 25}, 100).size(), 20U);
}

}  // namespace
}  // namespace esim::studio
