#include "copying.h"

#include <fmt/format.h>

#include <chrono>
#include <map>

#include "commands.h"
#include "esim/files/number_text.h"
#include "esim/formats/formats.h"
#include "progress_bar.h"
#include "remedies.h"
#include "support.h"

namespace esim::app {
namespace {

void print_summary(const CopySummary& summary, const CopyArguments& arguments, double wall_s) {
  std::string copied;
  for (const auto& [content, count] : summary.copied)
    copied += fmt::format("{}{} {}", copied.empty() ? "" : ", ", grouped(count), describe(content));
  tell(stderr, "{}: {} in {:.1f} s: {}\n", summary.complete ? "done" : "interrupted",
       copied.empty() ? "nothing" : copied, wall_s, arguments.out);
}

}  // namespace

void add_copy_options(CLI::App& command, CopyArguments& arguments, const std::string& does) {
  command.add_option("-f,--format", arguments.format, "Format to write (default: by the extension of OUT)")
      ->type_name("NAME");
  command.add_option("--camera", arguments.copy.camera, does + " this camera only")->type_name("NAME");
  command.add_flag("--from-zero", arguments.copy.from_zero, "Write times relative to the start of the recording");
  command.add_option("--time-unit", arguments.copy.write.unit, "Unit of event times, if the format allows a choice")
      ->transform(CLI::CheckedTransformer(std::map<std::string, TimeUnit>{{"us", TimeUnit::us}, {"ns", TimeUnit::ns}})
                      .description(""))
      ->type_name("us|ns");
  command.add_option("--compression", arguments.copy.write.compression, "Of HDF5")
      ->transform(CLI::CheckedTransformer(std::map<std::string, Compression>{{"blosc", Compression::blosc},
                                                                             {"gzip", Compression::gzip},
                                                                             {"none", Compression::none}})
                      .description(""))
      ->type_name("blosc|gzip|none");
  add_sensor_options(command, arguments.sensor);
  command.add_flag("--recover", arguments.recover, does + " the readable part of a damaged file");
  command.add_flag("-q,--quiet", arguments.quiet, "Print warnings and errors only");
  command.add_flag("--force", arguments.force, "Replace an existing OUT");
}

int run_copy(const CopyArguments& arguments, const CLI::App& command,
             const std::function<CopySummary(const Format&, const ConvertOptions&,
                                             const std::function<bool(double)>& go_on)>& copy) {
  const auto start = std::chrono::steady_clock::now();
  const Format& format = arguments.format.empty() ? format_for(arguments.out) : format_named(arguments.format);
  ConvertOptions options;
  options.copy = arguments.copy, options.read.sensor = arguments.sensor, options.replace = arguments.force;
  if (arguments.recover) {
    options.read.recover = [](const std::string& problem) {
      tell(stderr, "warning: {}; everything before it is kept\n", problem);
    };
  }
  catch_interrupts();
  ProgressBar bar(!arguments.quiet);
  const CopySummary summary = copy(format, options, [&](double fraction) {
    bar.show(fraction, [&] { return fmt::format("{:.0f} %", 100 * fraction); });
    return !interrupted();
  });
  bar.clear();
  for (const Loss& loss : losses(summary, format))
    tell(stderr, "warning: {}\n", with_remedy(loss.what, loss.remedy, command));
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  if (!arguments.quiet) print_summary(summary, arguments, wall.count());
  return interrupted() ? kInterrupted : kOk;
}

}  // namespace esim::app
