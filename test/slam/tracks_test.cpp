// SPDX-License-Identifier: Apache-2.0
#include "tetap/slam/tracks.hpp"

#include "tetap/base/state_words.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <vector>

namespace tetap {
namespace {

using Store = slam::TrackStore<4, 5>;
using Image = std::vector<slam::ImageFeature>;

Image image_of(std::initializer_list<int> ids, int mark = 0) {
  Image image;
  for (const int id : ids)
    image.push_back({static_cast<std::uint16_t>(id), static_cast<std::uint16_t>(1000 + mark), 7});
  return image;
}
/// Slots of images go round as a window's do.
struct Film {
  Store store{3};
  int images = 0;
  std::vector<int> add(Image image) {
    store.begin(image);
    std::vector<int> chosen;
    for (int i = 0; i < store.chosen_count(); ++i) chosen.push_back(store.chosen(i).id);
    store.end(image, images++ % 4);
    return chosen;
  }
};

TEST(Tracks, ThoseThatEndedAreUsedBeforeThoseThatAreFullAndTwoAtMost) {
  Film film;
  for (int k = 0; k < 4; ++k) EXPECT_TRUE(film.add(image_of({3, 1, 2}, k)).empty());
  EXPECT_EQ(film.add(image_of({1, 2})), (std::vector<int>{3, 1})) << "3 ended; 1 and 2 are full";
  EXPECT_EQ(film.store.counters().left, 1U) << "2 lost its oldest sighting";
  EXPECT_EQ(film.add(image_of({1, 2})), (std::vector<int>{2})) << "1 began anew";
}

TEST(Tracks, SightingsLieInTheSlotsOfTheirImages) {
  Film film;
  for (int k = 0; k < 5; ++k) film.add(image_of({9}, k));
  const auto& track = film.store.track(0);
  ASSERT_EQ(track.count, 1) << "used when full, then begun anew";
  EXPECT_EQ(track.slot(0), 0);
  EXPECT_EQ(track.seen[0][0], 1004);
}

TEST(Tracks, AbsenceInOneImageMakesANewTrack) {
  Film film;
  for (int k = 0; k < 3; ++k) film.add(image_of({4095}));
  EXPECT_EQ(film.add(image_of({})), (std::vector<int>{4095}));
  film.add(image_of({4095}));
  EXPECT_EQ(film.store.live(), 1);
  EXPECT_EQ(film.store.track(0).count, 1);
}

TEST(Tracks, AFullStoreRefusesAndCounts) {
  Film film;
  film.add(image_of({1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(film.store.live(), 5);
  EXPECT_EQ(film.store.counters().no_room, 2U);
  film.add(image_of({6, 7}));
  EXPECT_EQ(film.store.live(), 2) << "room is there again";
  EXPECT_EQ(film.store.counters().no_room, 2U);
}

TEST(Tracks, AnIdentityThatCameTwiceIsAbsent) {
  Film film;
  for (int k = 0; k < 3; ++k) film.add(image_of({1, 2}));
  EXPECT_EQ(film.add(image_of({1, 2, 2})), (std::vector<int>{2})) << "2 ended";
  EXPECT_EQ(film.store.live(), 1);
  EXPECT_EQ(film.store.counters().duplicates, 1U);
}

TEST(Tracks, TheOrderOfAnImageHasNoEffect) {
  std::vector<std::uint32_t> expected;
  for (int turn = 0; turn < 5; ++turn) {
    Film film;
    for (int k = 0; k < 9; ++k) {
      Image image = image_of({1, 2, 3, 2, 40 + k, 20 + k, 9});
      std::rotate(image.begin(), image.begin() + turn, image.end());
      film.add(image);
    }
    std::vector<std::uint32_t> state;
    const auto sink = [&](std::uint32_t word) { state.push_back(word); };
    base::each_word(film.store, sink);
    if (turn == 0) expected = state;
    EXPECT_EQ(state, expected) << turn;
  }
}

}  // namespace
}  // namespace tetap
