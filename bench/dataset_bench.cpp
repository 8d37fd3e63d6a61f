// Sequences of `esim dataset affine` by one thread, 240 x 180 pixels of 0.04 s: made in memory (make), and made and
// written with motion_field, optical_flow and tensor (write/hdf5, write/webdataset). "sequences" are per second,
// "events" and "bytes" per sequence.
#include <benchmark/benchmark.h>

#include <filesystem>

#include "esim/dataset/files/contents.h"
#include "esim/dataset/generators/affine_sequences.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

constexpr std::uint32_t kSequences = 100;

/// Makes them all, and gives each to `use`; returns the number of events.
template <typename Use>
std::size_t make_all(const AffineSequences& sequences, Use use) {
  std::size_t events = 0;
  for (std::uint32_t i = 0; i < kSequences; ++i) {
    const Sequence sequence = sequences.make(i);
    events += sequence.events.size();
    use(sequence);
  }
  return events;
}

void count(benchmark::State& state, std::size_t events, double bytes) {
  state.counters["sequences"] = benchmark::Counter(kSequences, benchmark::Counter::kIsIterationInvariantRate);
  state.counters["events"] = static_cast<double>(events) / kSequences;
  if (bytes > 0) state.counters["bytes"] = bytes / kSequences;
}

void make(benchmark::State& state) {
  const AffineSequences sequences({});
  std::size_t events = 0;
  for (auto _ : state) events = make_all(sequences, [](const Sequence&) {});
  count(state, events, 0);
}

void write(benchmark::State& state, std::unique_ptr<ShardWriter> (*make_writer)(const std::filesystem::path&)) {
  const AffineSequences sequences({});
  const test::TemporaryDirectory folder;
  const std::filesystem::path file = folder.path() / "shard";
  std::size_t events = 0;
  for (auto _ : state) {
    const auto writer = make_writer(file);
    events = make_all(sequences, [&](const Sequence& sequence) {
      writer->add(SequenceArrays(sequence, {.tensor = true}).shard_sequence());
    });
    writer->finish();
  }
  count(state, events, static_cast<double>(std::filesystem::file_size(file)));
}

BENCHMARK(make)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(write, hdf5, make_hdf5_shard)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(write, webdataset, make_tar_shard)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace esim
