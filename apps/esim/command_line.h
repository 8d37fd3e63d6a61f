#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include "esim/core/describe.h"

namespace esim::app {

/// A visitor of describe() that adds a command-line option for every member: --max-steps for max_steps. With a prefix
/// "trail", it is --trail-max-steps.
class CommandLine {
 public:
  explicit CommandLine(CLI::App& command, const std::string& prefix = {})
      : command_(command), start_(prefix.empty() ? "--" : "--" + dashed(prefix) + "-") {}

  /// All options are listed under this title in the help.
  CommandLine& titled(std::string title) {
    title_ = std::move(title);
    return *this;
  }

  void operator()(const char* name, bool& value, const About& about) {
    if (value) {
      add(command_.add_flag_callback(
          "--no-" + dashed(name), [&value] { value = false; }, fmt::format("Do not {}", about.help)));
    } else {
      add(command_.add_flag(start_ + dashed(name), value, help(about)));
    }
  }

  template <typename T>
  void operator()(const char* name, T& value, const About& about) {
    CLI::Option* option = command_.add_option(start_ + dashed(name), value, help(about));
    add(option);
    if constexpr (std::is_enum_v<T>) {
      std::map<std::string, T> names;
      std::string choices;
      for (const char* word : kEnumNames<T>) {
        choices += (names.empty() ? "" : "|") + std::string(word);
        names.emplace(word, static_cast<T>(names.size()));
      }
      option->type_name(choices)->transform(CLI::CheckedTransformer(names).description(""));
    } else {
      option->type_name(*about.unit != '\0' ? about.unit : "N")->check([about](const std::string& text) {
        return out_of_range(text, about);
      });
      if constexpr (std::is_arithmetic_v<T>) option->capture_default_str();
    }
  }

  /// Whether any of the options has been given.
  bool given() const {
    return std::any_of(options_.begin(), options_.end(), [](const CLI::Option* option) { return option->count() > 0; });
  }

  /// Adds an option that was made elsewhere to those of given(), and to the title.
  CLI::Option* add(CLI::Option* option) {
    if (!title_.empty()) option->group(title_);
    options_.push_back(option);
    return option;
  }

 private:
  static std::string dashed(std::string name) {
    std::replace(name.begin(), name.end(), '_', '-');
    return name;
  }

  static std::string help(const About& about) {
    std::string text = about.help;
    text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
    return text;
  }

  /// Returns the error, or an empty text, as CLI11 expects.
  static std::string out_of_range(const std::string& text, const About& about) {
    double value = 0;
    if (!CLI::detail::lexical_cast(text, value)) return fmt::format("'{}' is not a number", text);
    if (value <= about.max && (about.above_min ? value > about.min : value >= about.min)) return "";
    return fmt::format("{} is out of range: must be {} {} and at most {}", text, about.above_min ? "above" : "at least",
                       about.min, about.max);
  }

  CLI::App& command_;
  std::string start_, title_;
  std::vector<CLI::Option*> options_;
};

}  // namespace esim::app
