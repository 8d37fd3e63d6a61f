#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace esim::studio {

/// What is opened, and to whom.
struct StudioOptions {
  std::filesystem::path opened{};              ///< a scenario, a scene or a recording; empty: nothing
  std::vector<std::filesystem::path> roots{};  ///< beside the folder of what is opened; without both, the current one
  std::filesystem::path pages{};               ///< folder of the page
  std::string host = "127.0.0.1";
  int port = 0;         ///< 0: the usual one, or one of those that follow
  std::string token{};  ///< empty: a new one
  int threads = 0;      ///< of rendering and simulating; 0: every processor
};

/// The usual port.
inline constexpr int kStudioPort = 8391;

/// A server of pages by which one designs recordings, makes them and looks at them.
class Studio {
 public:
  /// Begins to answer. Throws UserError where what is opened is not there, the page is not built, the port is taken, or
  /// other machines could reach the server without a token of the user's own.
  explicit Studio(const StudioOptions& options);

  /// Ends a recording that is being made, in order, and all connections.
  ~Studio();

  /// To be opened in a browser; it holds the token.
  std::string url() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim::studio
