#pragma once

#include <memory>
#include <utility>
#include <vector>

// Private to backends/opengl.
namespace esim::inline backends::inline opengl {

/// What an image that the device renders borrows from its renderer, and gives back for the next one.
template <class T>
class GlBorrowed {
 public:
  /// Takes an idle one, or makes one; `idle` must outlive it.
  explicit GlBorrowed(std::vector<std::unique_ptr<T>>& idle) : idle_(idle) {
    if (idle.empty()) idle.push_back(std::make_unique<T>());
    value_ = std::move(idle.back());
    idle.pop_back();
  }
  ~GlBorrowed() { idle_.push_back(std::move(value_)); }
  GlBorrowed(const GlBorrowed&) = delete;
  GlBorrowed& operator=(const GlBorrowed&) = delete;

  T& operator*() { return *value_; }
  T* operator->() { return value_.get(); }

 private:
  std::vector<std::unique_ptr<T>>& idle_;
  std::unique_ptr<T> value_;
};

}  // namespace esim::inline backends::inline opengl
