#include "esim/scenario/suggest.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace esim::inline scenario {
namespace {

/// Levenshtein distance.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({substituted, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

}  // namespace

std::string nearest(const std::string& word, const std::vector<std::string>& candidates) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 2) + 1;
  for (const std::string& candidate : candidates) {
    // If the candidate contains the word, the distance counts as one wrong letter.
    const bool contained = word.size() >= 4 && candidate.find(word) != std::string::npos;
    const std::size_t distance = contained ? 1 : edit_distance(word, candidate);
    const bool shorter = distance == best_distance && candidate.size() < best.size();
    if (distance < best_distance || shorter) best = candidate, best_distance = distance;
  }
  return best;
}

std::string list(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : ", ") + word;
  return out;
}

}  // namespace esim::inline scenario
