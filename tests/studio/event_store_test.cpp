#include "esim/studio/event_store.h"

#include <gtest/gtest.h>

#include <filesystem>
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

class EventStoreTest : public testing::Test {
 protected:
  EventStoreTest() : file_(directory_.path() / "events.h5") {
    EventsHdf5Writer writer(file_, 0);
    RecordingInfo info;
    info.cameras.resize(1);
    info.cameras[0].model.width = 64, info.cameras[0].model.height = 48;
    info.end = 3 * kNsPerSecond;
    writer.begin(info);
    writer.write(EventsRecord{0, events_});
    writer.end(true);
  }

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
    std::uint64_t all = 0;
    for (std::size_t i = 0; i < bins; ++i) all += a.on[i] + a.off[i];
    EXPECT_EQ(all, events_.size());
    EXPECT_EQ(a.on, b.on) << bins;  // borders of bins of whole ms, or counted one by one
    EXPECT_EQ(a.off, b.off) << bins;
  }
}

TEST_F(EventStoreTest, TheWholeOfARecordingCountsAllOfItsEvents) {
  const auto file = store_of(EventsHdf5Reader(file_));
  for (const std::size_t bins : {2U, 100U, 5000U}) {
    const EventRate rate = file->rate(events_.front().t, events_.back().t + 1, bins);
    std::uint64_t all = 0;
    for (std::size_t i = 0; i < bins; ++i) all += rate.on[i] + rate.off[i];
    EXPECT_EQ(all, events_.size()) << bins;
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
