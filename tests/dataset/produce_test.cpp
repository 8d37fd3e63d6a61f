#include "esim/dataset/produce.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <fstream>
#include <map>
#include <sstream>
#include <thread>

#include "esim/core/error.h"
#include "esim/core/random.h"
#include "esim/dataset/files/manifest.h"
#include "esim/files/folder_plan.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

/// Sequences that are cheap to make and distinguishable.
class Numbers final : public SequenceMaker {
 public:
  explicit Numbers(std::uint32_t sensors = 1) : sensors_(sensors) {}

  std::string options() const override { return R"({"kind": "numbers", "seed": 1})"; }
  const MagnitudeHistogram& magnitudes() const override { return bins_; }
  bool is_target() const override { return true; }
  std::uint32_t sensors() const override { return sensors_; }
  std::vector<Sequence> make_all(std::uint32_t rendering) const override {
    ++made;
    std::vector<Sequence> sequences;
    for (std::uint32_t k = 0; k < sensors_; ++k) sequences.push_back(sequence_of(rendering * sensors_ + k));
    return sequences;
  }

  mutable std::atomic<int> made = 0;

 private:
  static Sequence sequence_of(std::uint32_t index) {
    Sequence sequence;
    sequence.index = index;
    sequence.width = 16, sequence.height = 8;
    sequence.span = {0, 1000};
    const AddressedRandom random(1, Purpose::test);
    for (std::uint32_t i = 0; i < 500 + index; ++i) {
      const auto words = random.bits(index, i);
      sequence.events.push_back({i, static_cast<std::uint16_t>(words[0] % 16), static_cast<std::uint16_t>(words[1] % 8),
                                 static_cast<std::int8_t>(words[2] % 2 == 0 ? 1 : -1)});
    }
    for (Image<float>* image : {&sequence.motion_field.x, &sequence.motion_field.y, &sequence.optical_flow.x,
                                &sequence.optical_flow.y, &sequence.first, &sequence.last}) {
      *image = Image<float>(16, 8, static_cast<float>(index % 7) * 0.1F);
    }
    sequence.info = R"({"index": )" + std::to_string(index) + "}";
    if (index % 5 == 3) sequence.passed_over["bad.png"] = "is bad";
    return sequence;
  }

  std::uint32_t sensors_;
  MagnitudeHistogram bins_{{0, 0.3, 1}, {0.5, 0.5}, "test"};
};

DatasetPlan plan_of(ShardFormat format) {
  return {.count = 23,
          .shard_size = 5,
          .format = format,
          .contents = {.images = true, .tensor = true, .voxel_bins = 3},
          .maker = Numbers().options()};
}

Production make(const fs::path& out, ShardFormat format, int threads, Share share = {}) {
  const Numbers maker;
  const DatasetFolder folder(out, plan_of(format), "1.0");
  const Production production = produce(folder, maker, share, threads, [](const auto&) { return true; });
  const DatasetState state = survey_dataset(folder);
  if (state.complete()) write_manifest(folder, state, maker.magnitudes(), true);
  return production;
}

/// A process that does this, and then ends: with 0, or 1 where it throws.
template <typename Work>
pid_t in_a_process(Work work) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  try {
    work();
  } catch (...) {
    ::_exit(1);
  }
  ::_exit(0);
}

/// Every file of a dataset, but for those that only its writers use.
std::map<std::string, std::string> content(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name == ".lock") continue;
    std::ostringstream text;
    text << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    files[name] = text.str();
  }
  return files;
}

class Produce : public testing::TestWithParam<ShardFormat> {
 protected:
  void SetUp() override {
    make(folder_.path() / "straight", GetParam(), 1);
    straight_ = content(folder_.path() / "straight");
  }
  test::TemporaryDirectory folder_;
  std::map<std::string, std::string> straight_;
};

TEST_P(Produce, MakesTheSameBytesWithAnyNumberOfThreads) {
  EXPECT_EQ(straight_.size(), 2 * 5U + 5U) << "five shards and their records, plan, manifest, report, two pictures";
  make(folder_.path() / "two", GetParam(), 2);
  EXPECT_TRUE(content(folder_.path() / "two") == straight_);
  EXPECT_TRUE(check_dataset(DatasetFolder(folder_.path() / "two")).empty());
}

TEST_P(Produce, RendersOnceForSeveralSensors) {
  const fs::path out = folder_.path() / "sensors";
  const DatasetFolder folder(out, plan_of(GetParam()), "1.0");
  const Numbers maker(4);
  produce(folder, maker, {}, 2, [](const auto&) { return true; });
  write_manifest(folder, survey_dataset(folder), maker.magnitudes(), true);
  EXPECT_TRUE(content(out) == straight_);
  EXPECT_EQ(maker.made, 6 + 3) << "six renderings for 23 sequences; three of them are in two shards";
}

TEST_P(Produce, MakesTheSameBytesInShares) {
  const fs::path out = folder_.path() / "fractions";
  for (const std::uint32_t part : {2U, 0U, 1U}) make(out, GetParam(), 1, {part, 3});
  EXPECT_TRUE(content(out) == straight_);
}

TEST_P(Produce, MakesOnlyWhatIsMissing) {
  const fs::path out = folder_.path() / "straight";
  const DatasetFolder folder(out, plan_of(GetParam()), "1.0");
  fs::remove(out / folder.shard_name(3));
  fs::remove(folder.record_path(2));
  std::ofstream(out / folder.shard_name(0), std::ios::app) << "x";
  std::ofstream(folder.record_path(4)) << "{\"shard\": 4";
  const Numbers maker;
  produce(folder, maker, {}, 1, [](const auto&) { return true; });
  EXPECT_EQ(maker.made, 3 * 5 + 3);
  EXPECT_TRUE(content(out) == straight_);
}

TEST_P(Produce, IsTheSameAfterBeingKilledAtAnyMoment) {
  const fs::path out = folder_.path() / "killed";
  int killed = 0;
  for (int run = 0;; ++run) {
    ASSERT_LT(run, 100);
    const pid_t child = in_a_process([&] { make(out, GetParam(), 1); });
    std::this_thread::sleep_for(std::chrono::microseconds(3000 + 5711 * run));
    ::kill(child, SIGKILL);
    int status = 0;
    ::waitpid(child, &status, 0);
    if (WIFEXITED(status)) break;
    ++killed;
  }
  EXPECT_GE(killed, 1);
  EXPECT_TRUE(content(out) == straight_) << "and nothing else is left";
}

TEST_P(Produce, SharesNoShard) {
  const fs::path out = folder_.path() / "locked";
  const DatasetFolder folder(out, plan_of(GetParam()), "1.0");
  const Numbers maker;
  {
    const FolderLock lock(folder.path(), 3), again(folder.path(), 3), other(folder.path(), 4);
    EXPECT_TRUE(lock.owned() && !again.owned() && other.owned());
    const Production production = produce(folder, maker, {}, 2, [](const auto&) { return true; });
    EXPECT_FALSE(production.complete());
    EXPECT_EQ(production.elsewhere, 2U);
    EXPECT_EQ(production.progress.done, 15U);
  }
  EXPECT_EQ(check_dataset(folder).size(), 2U);
  make(out, GetParam(), 1);
  EXPECT_TRUE(content(out) == straight_);
}

TEST_P(Produce, ProcessesMayWorkAtTheSameTime) {
  const fs::path out = folder_.path() / "together";
  std::vector<pid_t> children;
  for (int i = 0; i < 3; ++i) {
    children.push_back(in_a_process([&] { make(out, GetParam(), 1); }));
  }
  for (const pid_t child : children) {
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
  }
  make(out, GetParam(), 1);  // whoever had to wait for a shard has left it
  EXPECT_TRUE(content(out) == straight_);
}

TEST_P(Produce, KeepsCompleteShardsWhenTheDiskIsFull) {
  const fs::path out = folder_.path() / "full";
  const pid_t child = in_a_process([&] {
    std::signal(SIGXFSZ, SIG_IGN);
    const DatasetFolder folder(out, plan_of(GetParam()), "1.0");
    const Numbers maker;
    const std::string problem = test::message_of<OutputError>([&] {
      produce(folder, maker, {}, 1, [&](const ProductionProgress& progress) {
        const rlimit limit{4096, 4096};
        if (progress.made == 12) ::setrlimit(RLIMIT_FSIZE, &limit);
        return true;
      });
    });
    ::_exit(problem.find("cannot write") != std::string::npos ? 0 : 1);
  });
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  const DatasetFolder folder(out);
  EXPECT_EQ(survey_dataset(folder).shards.size(), 2U);
  make(out, GetParam(), 1);
  EXPECT_TRUE(content(out) == straight_);
}

TEST_P(Produce, EndsWhenItIsStopped) {
  const fs::path out = folder_.path() / "ended";
  const DatasetFolder folder(out, plan_of(GetParam()), "1.0");
  const Numbers maker;
  const Production production =
      produce(folder, maker, {}, 1, [](const ProductionProgress& progress) { return progress.made < 13; });
  EXPECT_EQ(production.progress.done, 10U) << "the shard that was begun is lost";
  EXPECT_EQ(maker.made, 13);
  make(out, GetParam(), 2);
  EXPECT_TRUE(content(out) == straight_);
}

TEST_P(Produce, IsCheckedByteByByte) {
  const fs::path out = folder_.path() / "straight";
  const DatasetFolder folder(out);
  EXPECT_TRUE(check_dataset(folder).empty());
  {
    std::fstream file(out / folder.shard_name(2), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(3000);
    file.put('\x7f');
  }
  const auto problems = check_dataset(folder);
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_TRUE(test::contains(problems[0], "is damaged"));
  fs::remove(out / folder.shard_name(2));
  EXPECT_TRUE(test::contains(check_dataset(folder).at(0), "sequences 10 to 14 are missing"));
  fs::remove(out / "manifest.json");
  make(out, GetParam(), 1);
  EXPECT_TRUE(content(out) == straight_);
}

INSTANTIATE_TEST_SUITE_P(Formats, Produce, testing::Values(ShardFormat::hdf5, ShardFormat::webdataset),
                         [](const auto& suite) { return suite.param == ShardFormat::hdf5 ? "hdf5" : "webdataset"; });

TEST(DatasetFolder, RefusesWhatIsAnotherDataset) {
  const test::TemporaryDirectory folder;
  const fs::path out = folder.path() / "out";
  DatasetPlan plan = plan_of(ShardFormat::hdf5);
  const auto problem = [&](const DatasetPlan& other, const char* version) {
    return test::message_of<UserError>([&] { DatasetFolder(out, other, version); });
  };
  DatasetFolder(out, plan, "1.0");
  EXPECT_EQ(problem(plan, "1.0"), "nothing was thrown");
  EXPECT_TRUE(test::contains(problem(plan, "1.1"), "begun by esim 1.0, but this is esim 1.1"));
  DatasetPlan more = plan;
  more.count = 24;
  EXPECT_TRUE(test::contains(problem(more, "1.0"), "sequences is 23 there, but 24 here"));
  DatasetPlan seeded = plan;
  seeded.maker = R"({"kind": "numbers", "seed": 2})";
  EXPECT_TRUE(test::contains(problem(seeded, "1.0"), "made_by.seed is 1 there, but 2 here"));
  std::ofstream(out / "dataset.json") << "{";
  EXPECT_TRUE(test::contains(problem(plan, "1.0"), "is damaged"));
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { DatasetFolder{out}; }), "is damaged"));

  fs::create_directories(folder.path() / "other");
  std::ofstream(folder.path() / "other" / "thesis.tex") << "x";
  const auto other = test::message_of<UserError>([&] { DatasetFolder(folder.path() / "other", plan, "1.0"); });
  EXPECT_TRUE(test::contains(other, "must be a dataset"));
  EXPECT_TRUE(
      test::contains(test::message_of<UserError>([&] { DatasetFolder(folder.path() / "none"); }), "is not a dataset"));
}

}  // namespace
}  // namespace esim
