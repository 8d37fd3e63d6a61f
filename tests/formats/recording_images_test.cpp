// The images in a recording's folder, with its ground truth.
#include <gtest/gtest.h>

#include "esim/files/number_text.h"
#include "esim/formats/formats.h"
#include "formats/recordings.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

constexpr int kFrames = 5;
constexpr TimeNs kStep = 100 * kNsPerMs;

class RecordingImages : public testing::Test {
 protected:
  RecordingImages() {
    const auto sink = format_named("recording").create(path_, {.compression = Compression::gzip});
    sink->begin(test::recording_info(24, 16, 0, kNsPerSecond));
    for (int i = 0; i < kFrames; ++i) sink->write(test::TruthImages(24, 16, 0.1 * i).at(i * kStep));
    sink->end(true);
  }

  struct Times {
    std::vector<TimeNs> images{}, truth{}, irradiance{};  // `irradiance`: of ground-truth frames that have one
  };
  Times times() const {
    Times found;
    const auto source = open_source(path_, {.recover = [](const std::string&) {}});
    while (const Record* record = source->next()) {
      if (const auto* image = std::get_if<ImageRecord>(record)) found.images.push_back(image->t);
      const auto* truth = std::get_if<TruthRecord>(record);
      if (truth == nullptr) continue;
      found.truth.push_back(truth->t);
      if (!truth->irradiance.empty()) found.irradiance.push_back(truth->t);
    }
    return found;
  }

  test::TemporaryDirectory base_;
  std::filesystem::path path_ = base_.path() / "out";
};

TEST_F(RecordingImages, AreTheIrradianceOfTheGroundTruth) {
  const Times found = times();
  EXPECT_TRUE(found.images.empty()) << "no image comes twice";
  EXPECT_EQ(found.truth.size(), static_cast<std::size_t>(kFrames));
  EXPECT_EQ(found.irradiance, found.truth);
}

TEST_F(RecordingImages, AtOtherTimesAreRecordsOfTheirOwn) {
  std::string list;
  std::vector<TimeNs> between;
  for (int i = 0; i < 2 * kFrames; ++i) {
    list += std::to_string(i) + " ";
    append_seconds(list, i * kStep / 2);
    list += " 00000" + std::to_string(i % kFrames) + ".png\n";
    if (i % 2 == 1) between.push_back(i * kStep / 2);
  }
  base_.write("out/cam0/images/timestamps.txt", list);
  const Times found = times();
  EXPECT_EQ(found.images, between);
  EXPECT_EQ(found.irradiance.size(), static_cast<std::size_t>(kFrames));
}

TEST_F(RecordingImages, AreNotLostWithDamagedGroundTruth) {
  const std::string truth = test::content(path_ / "cam0/truth.h5");
  int partly = 0;
  for (std::size_t k = 1; k < 20; ++k) {
    std::string damaged = truth;
    const std::size_t at = k * truth.size() / 20;
    std::fill_n(damaged.begin() + static_cast<std::ptrdiff_t>(at), std::min<std::size_t>(200, truth.size() - at), '\0');
    base_.write("out/cam0/truth.h5", damaged);
    const Times found = times();
    std::vector<TimeNs> all = found.images;
    all.insert(all.end(), found.irradiance.begin(), found.irradiance.end());
    std::sort(all.begin(), all.end());
    ASSERT_EQ(all.size(), static_cast<std::size_t>(kFrames)) << "damage at byte " << at;
    for (int i = 0; i < kFrames; ++i) EXPECT_EQ(all[static_cast<std::size_t>(i)], i * kStep);
    partly += !found.truth.empty() && found.truth.size() < kFrames;
  }
  EXPECT_GT(partly, 0) << "the ground truth ended early";
}

}  // namespace
}  // namespace esim
