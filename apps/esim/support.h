#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "esim/compose/compose.h"

namespace esim::app {

/// From now on, Ctrl-C and SIGTERM are only remembered.
void catch_interrupts();
bool interrupted();

/// Prints warnings and, unless `quiet`, notes; keeps both in `given` for the report.
Notices print_and_keep(std::vector<std::string>& given, bool quiet);

void write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace esim::app
