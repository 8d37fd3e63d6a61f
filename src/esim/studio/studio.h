#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace esim::studio {

/// Options of the studio.
struct StudioOptions {
  std::filesystem::path opened{};  ///< a scenario, a scene or a recording; may be empty
  std::vector<std::filesystem::path>
      roots{};                    ///< in addition to the folder of `opened`; without both, the current folder
  std::filesystem::path pages{};  ///< folder of the page
  std::string host = "127.0.0.1";
  int port = 0;         ///< 0: the default port or one of the next
  std::string token{};  ///< empty: a new random one
  int threads = 0;      ///< for rendering and simulating; 0: every processor
};

/// The default port.
inline constexpr int kStudioPort = 8391;

/// A web server with pages to design, make and view recordings.
class Studio {
 public:
  /// Starts answering. Throws UserError if `opened` does not exist, the page is not built, the port is in use, or other
  /// machines could reach the server without a token chosen by the user.
  explicit Studio(const StudioOptions& options);

  /// Ends a running recording in order, and all connections.
  ~Studio();

  /// The address to open in a browser; it contains the token.
  std::string url() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim::studio
