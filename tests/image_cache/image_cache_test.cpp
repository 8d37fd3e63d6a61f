// The files of a cache.
#include "esim/image_cache/image_cache.h"

#include <gtest/gtest.h>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>
#include <fstream>
#include <random>
#include <vector>

#include "esim/core/inputs/sha256.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kPlenty = 1'000'000'000;

std::string key_of(int number) { return sha256(std::to_string(number)); }

/// Bytes that cannot be compressed, different for each number.
std::string image_of(int number, std::size_t bytes = 10'000) {
  std::mt19937 random(static_cast<std::uint32_t>(number));
  std::string image(bytes, '\0');
  for (char& byte : image) byte = static_cast<char>(random());
  return image;
}

class ImageCacheTest : public testing::Test {
 protected:
  ImageCache open(std::uint64_t max_bytes = kPlenty) const { return open(folder_.path() / "images", max_bytes); }
  ImageCache open(const fs::path& folder, std::uint64_t max_bytes) const {
    return {folder, max_bytes, [this](const std::string& text) { warnings_.push_back(text); }};
  }
  fs::path file_of(int number) const { return folder_.path() / "images" / (key_of(number) + ".image"); }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_.path() / "images"), {}));
  }

  const test::TemporaryDirectory folder_;
  mutable std::vector<std::string> warnings_;
};

TEST_F(ImageCacheTest, GivesBackWhatItsProcessOrAnotherStored) {
  ImageCache first = open();
  EXPECT_FALSE(first.load(key_of(1), 10'000));
  EXPECT_FALSE(fs::exists(folder_.path() / "images")) << "nothing is created before the first image";
  first.store(key_of(1), image_of(1));
  first.store(key_of(2), std::string(50'000, 'a'));
  EXPECT_TRUE(first.load(key_of(1), 10'000) == image_of(1));
  ImageCache second = open();
  EXPECT_TRUE(second.load(key_of(1), 10'000) == image_of(1));
  EXPECT_TRUE(second.load(key_of(2), 50'000) == std::string(50'000, 'a'));
  EXPECT_LT(fs::file_size(file_of(2)), 1000U) << "compressed";
  EXPECT_EQ(files(), 2U) << "no temporary files remain";
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(ImageCacheTest, DamagedImagesAreMissingWithOneWarning) {
  const auto damaged = [&](const std::function<void(std::string&)>& damage) {
    ImageCache cache = open();
    cache.store(key_of(1), image_of(1));
    std::string bytes;
    {
      std::ifstream in(file_of(1), std::ios::binary);
      bytes.assign(std::istreambuf_iterator<char>(in), {});
    }
    damage(bytes);
    std::ofstream(file_of(1), std::ios::binary) << bytes;
    warnings_.clear();
    EXPECT_FALSE(cache.load(key_of(1), 10'000));
    EXPECT_FALSE(cache.load(key_of(1), 10'000));
    ASSERT_EQ(warnings_.size(), 1U);
    EXPECT_NE(warnings_[0].find(file_of(1).string()), std::string::npos) << warnings_[0];
    cache.store(key_of(1), image_of(1));
    EXPECT_TRUE(cache.load(key_of(1), 10'000) == image_of(1)) << "replaced";
  };
  damaged([](std::string& bytes) { bytes.resize(bytes.size() / 2); });
  damaged([](std::string& bytes) { bytes.clear(); });
  damaged([](std::string& bytes) { bytes = "something else"; });
  damaged([](std::string& bytes) { bytes += "x"; });
  for (const std::size_t at : {std::size_t{0}, std::size_t{5}, std::size_t{5000}, std::size_t{10'010}})
    damaged([at](std::string& bytes) { bytes.at(at) ^= 1; });
}

TEST_F(ImageCacheTest, AnImageOfAnotherSizeIsDamaged) {
  ImageCache cache = open();
  cache.store(key_of(1), image_of(1, 400));
  EXPECT_FALSE(cache.load(key_of(1), 500));
  EXPECT_EQ(warnings_.size(), 1U);
}

TEST_F(ImageCacheTest, TheLeastRecentlyUsedImagesGoFirst) {
  constexpr std::uint64_t kLimit = 200'500;  // twenty images
  ImageCache cache = open(kLimit);
  const auto old = fs::file_time_type::clock::now() - std::chrono::hours(1);
  for (int i = 0; i < 20; ++i) {
    cache.store(key_of(i), image_of(i));
    fs::last_write_time(file_of(i), old + std::chrono::seconds(i));
  }
  EXPECT_EQ(files(), 20U);
  std::ofstream(folder_.path() / "images" / "notes.txt") << "not the cache's";
  EXPECT_TRUE(cache.load(key_of(0), 10'000)) << "now the most recent";
  cache.store(key_of(20), image_of(20));
  EXPECT_TRUE(fs::exists(file_of(0)));
  EXPECT_TRUE(fs::exists(file_of(20)));
  EXPECT_TRUE(fs::exists(folder_.path() / "images" / "notes.txt"));
  // 18 of 21 images leave a tenth free.
  for (int i = 1; i < 20; ++i) EXPECT_EQ(fs::exists(file_of(i)), i > 3) << i;

  // Images of other processes count.
  ImageCache other = open(kLimit / 2);
  other.store(key_of(30), image_of(30));
  EXPECT_EQ(files(), 11U) << "nine, the new one and the notes";
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(ImageCacheTest, WhatKilledProcessesDidNotCompleteIsRemovedLater) {
  open().store(key_of(1), image_of(1));
  const fs::path draft = folder_.path() / "images" / (key_of(2) + ".0123456789abcdef.tmp");
  const fs::path recent = folder_.path() / "images" / (key_of(3) + ".0123456789abcdef.tmp");
  std::ofstream(draft) << "part";
  std::ofstream(recent) << "part";
  fs::last_write_time(draft, fs::file_time_type::clock::now() - std::chrono::hours(2));
  open().store(key_of(4), image_of(4));
  EXPECT_FALSE(fs::exists(draft));
  EXPECT_TRUE(fs::exists(recent)) << "may be in progress";
}

TEST_F(ImageCacheTest, AFolderThatCannotBeWrittenIsWarnedOfOnce) {
  folder_.write("file", "");
  for (const fs::path& folder : {folder_.path() / "file" / "images", fs::path("/proc/esim_images")}) {
    warnings_.clear();
    ImageCache cache = open(folder, kPlenty);
    for (int i = 0; i < 3; ++i) {
      EXPECT_FALSE(cache.load(key_of(i), 10'000));
      cache.store(key_of(i), image_of(i));
    }
    ASSERT_EQ(warnings_.size(), 1U);
    EXPECT_NE(warnings_[0].find(folder.string()), std::string::npos) << warnings_[0];
  }
}

TEST_F(ImageCacheTest, AFullDiskIsWarnedOfOnce) {
  // /dev/full cannot be a folder: the limit of a file's size has the same effect as a full disk.
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{5000, 5000};
    ::setrlimit(RLIMIT_FSIZE, &small);
    ImageCache cache = open();
    cache.store(key_of(1), std::string(10'000, 'a'));
    bool good = warnings_.empty();
    for (int i = 2; i < 5; ++i) cache.store(key_of(i), image_of(i));
    good = good && warnings_.size() == 1 && files() == 1 && cache.load(key_of(1), 10'000);
    ::_exit(good ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

// Processes store and load the same images, evict them, and are killed at random moments. What remains is right.
TEST_F(ImageCacheTest, ProcessesThatAreKilledLeaveNoDamage) {
  constexpr int kImages = 40;
  constexpr std::uint64_t kLimit = 30 * 10'000;
  std::mt19937 random(5);
  const auto work = [&](unsigned seed) {
    ImageCache cache = open(kLimit);
    std::mt19937 choice(seed);
    while (warnings_.empty()) {
      const int i = static_cast<int>(choice() % kImages);
      const auto found = cache.load(key_of(i), 10'000);
      if (found && *found != image_of(i)) ::_exit(2);
      if (!found) cache.store(key_of(i), image_of(i));
    }
    ::_exit(3);
  };
  for (int round = 0; round < 30; ++round) {
    pid_t children[2];
    for (pid_t& child : children) {
      const auto seed = static_cast<unsigned>(random());
      child = ::fork();
      if (child == 0) work(seed);
    }
    for (const pid_t child : children) {
      ::usleep(static_cast<useconds_t>(random() % 20'000));
      ::kill(child, SIGKILL);
      int status = 0;
      ASSERT_EQ(::waitpid(child, &status, 0), child);
      ASSERT_TRUE(WIFSIGNALED(status)) << "it found a wrong image (2) or had a warning (3): " << WEXITSTATUS(status);
    }
  }
  ImageCache cache = open(kLimit);
  int there = 0;
  for (int i = 0; i < kImages; ++i) {
    const auto found = cache.load(key_of(i), 10'000);
    there += found ? 1 : 0;
    EXPECT_TRUE(!found || *found == image_of(i));
  }
  EXPECT_GT(there, 10);
  EXPECT_TRUE(warnings_.empty());
}

}  // namespace
}  // namespace esim
