#pragma once

#include <filesystem>
#include <string>
#include <vector>

/// Runs scripts in Blender.
namespace esim::inline blender {

/// A temporary folder for one run, which is removed with the object.
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

/// The path of Blender. If it is missing, throws UserError, which names the scene and says how to install Blender.
std::string blender_program(const std::filesystem::path& scene);

/// A script in memory, which child processes can read as a file while the object exists. It is never on a disk, so that
/// nothing remains, however the processes end.
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

/// The command with which Blender runs a script with arguments. Blender then has no display and none of the user's
/// settings, does not run scripts of scenes, and exits with status 3 if the script fails.
std::vector<std::string> blender_command(const std::string& program, const ScriptInMemory& script,
                                         const std::vector<std::string>& arguments);

/// The last line of Blender's output that looks like an error message, or else the last line.
std::string reason_in(const std::string& output);

}  // namespace esim::inline blender
