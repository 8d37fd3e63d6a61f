#include "esim/dataset/produce.h"

#include <unistd.h>

#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "esim/core/error.h"
#include "esim/dataset/files/checksum.h"
#include "esim/dataset/files/preview.h"
#include "esim/files/folder_plan.h"
#include "esim/files/output_file.h"
#include "esim/preview/pictures.h"

namespace esim::inline dataset {
namespace {

namespace fs = std::filesystem;

/// Counts pixels by the magnitude of their optical flow.
void count_magnitudes(const VectorField& optical_flow, const MagnitudeHistogram& bins,
                      std::vector<std::uint64_t>& counts) {
  for (std::size_t i = 0; i < optical_flow.x.size(); ++i) {
    const double magnitude = std::hypot(optical_flow.x.data()[i], optical_flow.y.data()[i]);
    if (std::isfinite(magnitude)) ++counts[bins.bin_of(magnitude)];
  }
}

std::unique_ptr<ShardWriter> make_writer(ShardFormat format, const fs::path& file) {
  return format == ShardFormat::hdf5 ? make_hdf5_shard(file) : make_tar_shard(file);
}

/// A temporary file, which is removed unless it is kept.
struct WorkingFile {
  fs::path path;
  bool kept = false;
  ~WorkingFile() {
    if (!kept) ::unlink(path.c_str());
  }
};

class Run {
 public:
  Run(const DatasetFolder& folder, const SequenceMaker& maker, const Share& share, const ProductionMonitor& monitor)
      : folder_(folder), maker_(maker), monitor_(monitor) {
    const DatasetPlan& plan = folder.plan();
    for (std::uint32_t shard = share.part; shard < plan.shards(); shard += share.parts) {
      result_.progress.all += plan.size_of(shard);
      if (folder.record(shard)) {
        result_.progress.done += plan.size_of(shard);
      } else {
        missing_.push_back(shard);
      }
    }
  }

  Production finish(int threads) {
    if (!monitor_(result_.progress)) return result_;
    std::vector<std::thread> others;
    const auto count = std::min<std::size_t>(static_cast<std::size_t>(threads), missing_.size());
    for (std::size_t i = 1; i < count; ++i) others.emplace_back([&] { work(); });
    if (count > 0) work();
    for (std::thread& other : others) other.join();
    if (problem_) std::rethrow_exception(problem_);
    return result_;
  }

 private:
  void work() {
    try {
      while (!stop_) {
        const std::size_t next = next_++;
        if (next >= missing_.size()) return;
        take(missing_[next]);
      }
    } catch (...) {
      const std::lock_guard locked(mutex_);
      if (!problem_) problem_ = std::current_exception();
      stop_ = true;
    }
  }

  /// Makes a shard unless another process makes it.
  void take(std::uint32_t shard) {
    const FolderLock lock(folder_.path(), shard);
    if (!lock.owned()) {
      const std::lock_guard locked(mutex_);
      ++result_.elsewhere;
      return;
    }
    if (folder_.record(shard)) {  // another process was faster
      const std::lock_guard locked(mutex_);
      result_.progress.done += folder_.plan().size_of(shard);
      return;
    }
    folder_.remove_leftovers(shard);
    make(shard);
  }

  void make(std::uint32_t shard) {
    const DatasetPlan& plan = folder_.plan();
    ShardRecord record{
        .shard = shard, .first = plan.first_of(shard), .count = plan.size_of(shard), .file = folder_.shard_name(shard)};
    record.magnitudes.assign(maker_.magnitudes().bins() + 1, 0);
    WorkingFile working{folder_.working_path(shard)};
    const auto writer = make_writer(plan.format, working.path);
    std::vector<Sequence> shown, rendered;
    const std::uint32_t sensors = maker_.sensors();
    for (std::uint32_t i = 0; i < record.count; ++i) {
      const std::uint32_t index = record.first + i;
      if (i == 0 || index % sensors == 0) rendered = maker_.make_all(index / sensors);
      Sequence sequence = std::move(rendered[index % sensors]);
      writer->add(SequenceArrays(sequence, plan.contents).shard_sequence());
      record.events += sequence.events.size();
      record.passed_over.insert(sequence.passed_over.begin(), sequence.passed_over.end());
      count_magnitudes(sequence.optical_flow, maker_.magnitudes(), record.magnitudes);
      if (!count_made(sequence.events.size())) return count_lost(i + 1);
      if (shard == 0 && shown.size() < kMaxShown) shown.push_back(std::move(sequence));
    }
    writer->finish();
    const FileChecksum written = checksum_of(working.path);
    record.bytes = written.bytes, record.crc32 = written.crc32;
    std::error_code error;
    fs::rename(working.path, folder_.path() / record.file, error);
    if (error) throw_cannot_write(folder_.path() / record.file, error.message());
    working.kept = true;
    if (shard == 0) write_file_atomically(folder_.path() / kPreviewName, encode_png(draw_sequences(shown)));
    folder_.write_record(record);
  }

  /// False if the production must end.
  bool count_made(std::uint64_t events) {
    const std::lock_guard locked(mutex_);
    ++result_.progress.done;
    ++result_.progress.made;
    result_.progress.events += events;
    if (!stop_ && !monitor_(result_.progress)) stop_ = true;
    return !stop_;
  }

  void count_lost(std::uint32_t sequences) {
    const std::lock_guard locked(mutex_);
    result_.progress.done -= sequences;
    result_.progress.made -= sequences;
  }

  const DatasetFolder& folder_;
  const SequenceMaker& maker_;
  const ProductionMonitor& monitor_;
  std::vector<std::uint32_t> missing_;
  std::atomic<std::size_t> next_ = 0;
  std::atomic<bool> stop_ = false;

  std::mutex mutex_;  // of the members below
  Production result_;
  std::exception_ptr problem_;
};

}  // namespace

Production produce(const DatasetFolder& folder, const SequenceMaker& maker, const Share& share, int threads,
                   const ProductionMonitor& monitor) {
  return Run(folder, maker, share, monitor).finish(threads);
}

}  // namespace esim::inline dataset
