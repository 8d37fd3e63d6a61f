#include "esim/compose/provenance.h"

#include <fstream>

namespace esim::inline compose {

void ProvenanceRecorder::add(const std::vector<UsedFile>& files) {
  for (const UsedFile& file : files) add(file);
}

Provenance ProvenanceRecorder::finish(bool wait) { return {repetition_, working_folder_, hashes_.finish(wait)}; }

std::filesystem::path current_folder() {
  std::error_code error;
  return std::filesystem::current_path(error);
}

std::string shell_quoted(const std::string& word) {
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string shell_command(const std::vector<std::string>& words) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+=./:,@%";
  std::string command;
  for (const std::string& word : words) {
    const bool plain = !word.empty() && word.find_first_not_of(kPlain) == std::string::npos;
    command += (command.empty() ? "" : " ") + (plain ? word : shell_quoted(word));
  }
  return command;
}

std::vector<std::string> own_command_line() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(file, word, '\0');) words.push_back(word);
  return words;
}

}  // namespace esim::inline compose
