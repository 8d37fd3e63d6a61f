#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <thread>

#include "esim/core/inputs/file_hashes.h"
#include "esim/core/inputs/sha256.h"
#include "esim/core/inputs/sha256_blocks.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOfAbc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

TEST(Sha256, EqualsThePublishedExamples) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), kOfAbc);
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(std::string(1'000'000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

// The padding depends on the length; the parts in which bytes come must not matter.
TEST(Sha256, DoesNotDependOnTheParts) {
  for (std::size_t length = 0; length <= 200; ++length) {
    std::string text(length, '\0');
    for (std::size_t i = 0; i < length; ++i) text[i] = static_cast<char>(i * 7 + length);
    const std::string whole = sha256(text);
    for (const std::size_t part : {1, 3, 55, 56, 63, 64, 65}) {
      Sha256 sum;
      for (std::size_t at = 0; at < length; at += part)
        sum.add(std::as_bytes(std::span(text).subspan(at, std::min(part, length - at))));
      EXPECT_EQ(sum.finish(), whole) << length << " bytes in parts of " << part;
    }
  }
}

TEST(Sha256, IsTheSameByEveryInstructionSet) {
  std::vector<std::byte> blocks(64 * 40);
  for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i] = static_cast<std::byte>(i * i + i / 7);
  std::array<std::uint32_t, 8> portable{1, 2, 3, 4, 5, 6, 7, 0xffffffff}, fastest = portable;
  for (const std::size_t count : {1, 2, 37}) {
    portable_sha256_blocks(portable, blocks.data(), count);
    fastest_sha256_blocks()(fastest, blocks.data(), count);
    EXPECT_EQ(fastest, portable);
  }
}

TEST(UsedFilesListener, ReceivesWhatItsThreadOpens) {
  const test::TemporaryDirectory folder;
  const fs::path a = folder.write("a", "abc"), b = folder.write("b", "");
  std::vector<fs::path> outer, inner;
  note_used(a);  // no listener
  const UsedFilesListener listening([&](const UsedFile& file) { outer.push_back(file.path); });
  {
    const UsedFilesListener alone([&](const UsedFile& file) { inner.push_back(file.path); });
    EXPECT_TRUE(open_input(b));
    std::thread([&] { note_used(a); }).join();
  }
  note_used(folder.path() / "x" / ".." / "a");
  EXPECT_EQ(inner, std::vector{b});
  EXPECT_EQ(outer, std::vector{a});
}

TEST(FileHashes, AreInTheOrderOfTheFilesAndOnceEach) {
  const test::TemporaryDirectory folder;
  const fs::path a = folder.write("a", "abc"), b = folder.write("b", std::string(3'000'000, 'b'));
  FileHashes hashes;
  for (const fs::path& path : {b, a, b, a}) hashes.add(used_file(path));
  hashes.add(used_text(folder.path() / "text", "abc"));
  const std::vector<HashedFile> files = hashes.finish(true);
  ASSERT_EQ(files.size(), 3);
  EXPECT_EQ(files[0].file.path, b);
  EXPECT_EQ(files[0].file.sha256, sha256(std::string(3'000'000, 'b')));
  EXPECT_EQ(files[0].file.bytes, 3'000'000);
  EXPECT_EQ(files[1].file.path, a);
  EXPECT_EQ(files[1].file.sha256, kOfAbc);
  EXPECT_EQ(files[2].file.path, folder.path() / "text");
  EXPECT_EQ(files[2].file.sha256, kOfAbc);
}

// A sum of what a file contains now would be wrong for the simulation that has read it before.
TEST(FileHashes, RefuseFilesThatHaveChanged) {
  const test::TemporaryDirectory folder;
  const fs::path a = folder.write("a", "abc"), gone = folder.write("gone", "abc");
  const UsedFile before = used_file(a), there = used_file(gone);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  folder.write("a", "xyz");
  fs::remove(gone);
  FileHashes hashes;
  hashes.add(before);
  hashes.add(there);
  hashes.add(used_file(folder.path() / "never"));
  for (const HashedFile& file : hashes.finish(true)) {
    EXPECT_EQ(file.file.sha256, "") << file.file.path;
    EXPECT_NE(file.problem, "") << file.file.path;
  }
}

TEST(FileHashes, DoNotWaitForPipes) {
  const test::TemporaryDirectory folder;
  const fs::path pipe = folder.path() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  FileHashes hashes;
  hashes.add(used_file(pipe));
  const std::vector<HashedFile> files = hashes.finish(true);
  ASSERT_EQ(files.size(), 1);
  EXPECT_EQ(files[0].file.sha256, "");
  EXPECT_EQ(files[0].problem, "is not a regular file");
}

TEST(FileHashes, EndAtOnceIfTheyAreNotNeeded) {
  const test::TemporaryDirectory folder;
  const fs::path large = folder.path() / "large";
  folder.write("large", "");
  fs::resize_file(large, std::uintmax_t{1} << 40);  // sparse; its sum would take an hour
  FileHashes hashes;
  hashes.add(used_file(large));
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const std::vector<HashedFile> files = hashes.finish(false);
  ASSERT_EQ(files.size(), 1);
  EXPECT_EQ(files[0].file.sha256, "");
  EXPECT_NE(files[0].problem, "");
}

}  // namespace
}  // namespace esim
