#pragma once

#include <memory>
#include <optional>
#include <string>

// Private to backends/opengl.
namespace esim::inline backends::inline opengl {

/// An OpenGL 4.5 context without a window.
class GlContext {
 public:
  /// Opens the device with this index, by default the first one that is not software. Throws UserError.
  explicit GlContext(std::optional<int> device);
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  /// Makes the context current in the calling thread during its lifetime.
  class Use {
   public:
    explicit Use(const GlContext& context);
    ~Use();
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    struct Before;
    void* display_;
    std::unique_ptr<Before> before_;
  };

  /// The driver's name for the device.
  const std::string& name() const;
  bool software() const;

 private:
  struct Handles;
  static std::unique_ptr<Handles> open(void* display);

  std::unique_ptr<Handles> handles_;
};

/// Throws if OpenGL has reported an error since the last call.
void throw_on_gl_error(const char* doing);

}  // namespace esim::inline backends::inline opengl
