#pragma once

#include <filesystem>
#include <string>
#include <vector>

/// How Blender is made to run a script; shared by what does so.
namespace esim {

/// A folder of its own for one run, gone with the object.
class ScratchFolder {
 public:
  explicit ScratchFolder(const std::filesystem::path& beside);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Where Blender is. Throws UserError, which names the scene and says how to install it, where there is none.
std::string blender_program(const std::filesystem::path& scene);

/// A script in memory, which the programs that this one starts can read as a file while the object lives. No disk has
/// it, so that none keeps it, however the programs end.
class ScriptInMemory {
 public:
  explicit ScriptInMemory(const std::string& script);
  ~ScriptInMemory();
  ScriptInMemory(const ScriptInMemory&) = delete;
  ScriptInMemory& operator=(const ScriptInMemory&) = delete;

  std::string path() const;

 private:
  int file_ = -1;
};

/// What to run so that Blender runs a script with arguments. Blender then has no display, none of the user's settings,
/// and runs no scripts of scenes; it ends with status 3 where the script fails.
std::vector<std::string> blender_command(const std::string& program, const ScriptInMemory& script,
                                         const std::vector<std::string>& arguments);

/// The last of what Blender said that sounds like a reason, on one line.
std::string reason_in(const std::string& output);

}  // namespace esim
