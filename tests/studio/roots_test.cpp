#include "esim/studio/roots.h"

#include <gtest/gtest.h>

#include <fstream>

#include "esim/core/error.h"
#include "esim/studio/server/http.h"
#include "support/temporary_directory.h"

namespace esim::studio {
namespace {

namespace fs = std::filesystem;

class RootsTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::canonical(directory_.path());
    fs::create_directories(folder_ / "open" / "sub");
    fs::create_directories(folder_ / "open-beside");
    std::ofstream(folder_ / "secret") << "x";
    std::ofstream(folder_ / "open-beside" / "secret") << "x";
    std::ofstream(folder_ / "open" / "sub" / "file") << "x";
    fs::create_symlink(folder_ / "secret", folder_ / "open" / "link");
    fs::create_directory_symlink(folder_, folder_ / "open" / "up");
    fs::create_directory_symlink("sub", folder_ / "open" / "inside");
    fs::create_symlink(folder_ / "missing", folder_ / "open" / "dangling");
  }

  int status(const std::string& path) const {
    try {
      Roots({folder_ / "open"}).existing(path);
      return 200;
    } catch (const HttpError& error) {
      return error.status();
    }
  }

  test::TemporaryDirectory directory_;
  fs::path folder_;
};

TEST_F(RootsTest, WhatIsBelowARootIsFound) {
  EXPECT_EQ(status("open"), 200);
  EXPECT_EQ(status("open/"), 200);
  EXPECT_EQ(status("open/sub/file"), 200);
  EXPECT_EQ(status("open//sub///file"), 200);
  EXPECT_EQ(status("open/inside/file"), 200);  // a link that stays within
  EXPECT_EQ(status("open/none"), 404);
  EXPECT_EQ(status("open/sub/file/none"), 404);
}

TEST_F(RootsTest, NothingLeadsOut) {
  for (const char* path : {"open/link", "open/up", "open/up/secret", "open/up/open/sub/file/../..", "open/../secret",
                           "open/sub/../../secret", "open/./sub", "open/..", "..", "", "/", "/etc/passwd", "other/file",
                           "open-beside/secret", "open/..\\secret", "open/%2e%2e/secret"}) {
    const int answer = status(path);
    EXPECT_TRUE(answer == 400 || answer == 403 || (answer == 404 && std::string(path).find('%') != std::string::npos))
        << path << " " << answer;
  }
  EXPECT_EQ(status(std::string("open/sub\0/file", 14)), 400);
  EXPECT_THROW(Roots({folder_ / "open"}).resolve("open/dangling"), HttpError);
}

TEST_F(RootsTest, NamesAreToldApart) {
  fs::create_directories(folder_ / "more" / "open");
  const Roots roots({folder_ / "open", folder_ / "more" / "open", folder_ / "open" / "sub" / ".."});
  ASSERT_EQ(roots.list().size(), 2U);
  EXPECT_EQ(roots.list()[0].name, "open");
  EXPECT_EQ(roots.list()[1].name, "open-2");
  EXPECT_EQ(roots.name_of(folder_ / "open" / "sub" / "file"), "open/sub/file");
  EXPECT_EQ(roots.name_of(folder_ / "secret"), "");
  EXPECT_FALSE(roots.contains(folder_ / "open-beside" / "secret"));
  EXPECT_FALSE(roots.contains(folder_ / "open" / "link"));
  EXPECT_THROW(Roots({folder_ / "none"}), UserError);
}

}  // namespace
}  // namespace esim::studio
