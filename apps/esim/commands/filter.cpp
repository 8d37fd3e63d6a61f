#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string_view>

#include "command_line.h"
#include "commands.h"
#include "copying.h"
#include "esim/core/error.h"
#include "esim/files/input_file.h"
#include "esim/files/number_text.h"
#include "esim/formats/filter_recording.h"
#include "support.h"

namespace esim::app {
namespace {

/// All filters with their options; those that have been requested are used.
struct Filters {
  RegionFilterOptions region;
  ActivityFilterOptions activity;
  AntiFlickerOptions anti_flicker;
  TrailFilterOptions trail;
  RateControllerOptions rate_controller;
  std::string mask_file;
};

struct FilterArguments : CopyArguments {
  Filters filters;
  std::function<FilterOptions()> requested;  // to be called after parsing
  bool json = false;
};

/// The numbers in "1,2,3". Throws CLI::ValidationError.
template <std::size_t N>
std::array<int, N> numbers_in(const std::string& option, const std::string& text, const char* expected) {
  std::array<int, N> numbers{};
  std::string_view rest = text;
  for (std::size_t i = 0; i < N; ++i) {
    const std::size_t comma = rest.find(',');
    const bool valid = parse_number(rest.substr(0, comma), numbers[i]) && numbers[i] >= 0 && numbers[i] <= 65536;
    if (!valid || (comma == std::string_view::npos) != (i + 1 == N))
      throw CLI::ValidationError(option, fmt::format("must be {} in px, not '{}'", expected, text));
    rest.remove_prefix(std::min(comma, rest.size() - 1) + 1);
  }
  return numbers;
}

/// Adds the pixels of a text file: a line "x y" for each.
void read_mask(const std::string& path, std::vector<MaskedPixelOptions>& pixels) {
  constexpr std::size_t kMaxLine = 4096;
  InputFile file(path);
  for (int number = 1; file.offset() < file.size(); ++number) {
    const std::string_view line = file.read_line(kMaxLine, "a line");
    std::string_view rest = line.substr(0, line.find('#'));
    const std::string_view x = take_word(rest), y = take_word(rest);
    if (x.empty()) continue;
    MaskedPixelOptions pixel;
    const bool valid = parse_number(x, pixel.x) && parse_number(y, pixel.y) && take_word(rest).empty();
    if (!valid || pixel.x < 0 || pixel.y < 0)
      throw UserError(
          fmt::format("{}:{}: must be a column and a row in px, such as 12 34, not '{}'", path, number, line));
    pixels.push_back(pixel);
  }
}

void add_region_options(CommandLine& options, CLI::App& command, Filters& filters) {
  const auto add_windows = [&](const char* name, bool invert, const char* help) {
    const auto add_window = [&filters, name, invert](const std::vector<std::string>& texts) {
      for (const std::string& text : texts) {
        const auto [x, y, width, height] = numbers_in<4>(name, text, "X,Y,WIDTH,HEIGHT");
        if (width < 1 || height < 1) throw CLI::ValidationError(name, "width and height must be at least 1 px");
        filters.region.windows.push_back({x, y, width, height});
      }
      filters.region.invert = invert;
    };
    return options.add(command.add_option_function<std::vector<std::string>>(name, add_window, help)
                           ->type_name("X,Y,WIDTH,HEIGHT")
                           ->expected(1)
                           ->take_all());
  };
  CLI::Option* inside = add_windows("--roi", false, "Keep the events in this window only; may be repeated");
  add_windows("--roni", true, "Drop the events in this window; may be repeated")->excludes(inside);
  const auto add_pixels = [&filters](const std::vector<std::string>& texts) {
    for (const std::string& text : texts) {
      const auto [x, y] = numbers_in<2>("--mask-pixel", text, "X,Y");
      filters.region.masked_pixels.push_back({x, y});
    }
  };
  options.add(command
                  .add_option_function<std::vector<std::string>>("--mask-pixel", add_pixels,
                                                                 "Drop the events of this pixel; may be repeated")
                  ->type_name("X,Y")
                  ->expected(1)
                  ->take_all());
  options.add(
      command
          .add_option("--mask-file", filters.mask_file, "Drop the events of the pixels in this text file: lines `x y`")
          ->type_name("FILE"));
}

/// Adds the options of one filter, and the flag --NAME that requests it with default values.
template <typename Options>
std::shared_ptr<CommandLine> add_filter_options(CLI::App& command, const std::string& name, const std::string& title,
                                                Options& options, const std::string& flag_help) {
  const auto line = std::make_shared<CommandLine>(command, name);
  line->titled(title);
  if (!flag_help.empty()) {
    std::string flag = "--" + name;
    std::replace(flag.begin(), flag.end(), '_', '-');
    line->add(command.add_flag(flag, flag_help));
  }
  describe(*line, options);
  return line;
}

/// Adds the options of all filters, in the order in which events pass them.
void add_all_filters(CLI::App& command, FilterArguments& arguments) {
  Filters& filters = arguments.filters;
  const auto region = std::make_shared<CommandLine>(command);
  region->titled("1. Regions and masked pixels");
  add_region_options(*region, command, filters);
  const auto activity = add_filter_options(command, "activity", "2. Event rate activity filter", filters.activity, "");
  const auto anti_flicker =
      add_filter_options(command, "anti_flicker", "3. Anti-flicker filter", filters.anti_flicker,
                         "Drop the events of flickering lamps and screens; the options below are optional");
  const auto trail = add_filter_options(command, "trail", "4. Event trail filter", filters.trail,
                                        "Keep one part of each burst of events; the options below are optional");
  const auto rate_controller =
      add_filter_options(command, "rate_controller", "5. Event rate controller", filters.rate_controller,
                         "Limit the number of events per period; the options below are optional");
  arguments.requested = [=, &filters] {
    FilterOptions options;
    if (region->given()) options.region = filters.region;
    if (region->given() && !filters.mask_file.empty()) read_mask(filters.mask_file, options.region->masked_pixels);
    if (activity->given()) options.activity = filters.activity;
    if (anti_flicker->given()) options.anti_flicker = filters.anti_flicker;
    if (trail->given()) options.trail = filters.trail;
    if (rate_controller->given()) options.rate_controller = filters.rate_controller;
    if (!options.any())
      throw UserError(
          "no filter is chosen; add --roi, --roni, --mask-pixel, --mask-file, --activity-lower-start, "
          "--anti-flicker, --trail or --rate-controller");
    return options;
  };
}

int run(const FilterArguments& arguments, const CLI::App& command) {
  const FilterOptions filters = arguments.requested();
  std::vector<FilteredCamera> cameras;
  const int code =
      run_copy(arguments, command, [&](const Format& format, const ConvertOptions& options, const auto& go_on) {
        FilterSummary summary = filter_recording(arguments.input, format, arguments.out, filters, options, go_on);
        cameras = std::move(summary.cameras);
        return summary.copy;
      });
  if (arguments.json) {
    fmt::print("{}\n", to_json(cameras));
  } else if (!arguments.quiet) {
    tell(stderr, "{}", describe(cameras));
  }
  return code;
}

}  // namespace

void add_filter(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<FilterArguments>();
  CLI::App* command =
      app.add_subcommand("filter", "Filter the events of a recording, as the digital blocks of Prophesee's sensors do");
  command
      ->add_option("in", arguments->input,
                   "Recording or event file of any format; esim detects the format from the content")
      ->required()
      ->type_name("IN");
  command->add_option("-o,--out", arguments->out, "File or folder to write")->required()->type_name("OUT");
  add_all_filters(*command, *arguments);
  add_copy_options(*command, *arguments, "Filter");
  command->add_flag("--json", arguments->json, "Print the numbers of events that each filter dropped as JSON");
  command->footer(
      "Events pass the filters in the order above. Everything else in the recording is copied.\n"
      "\n"
      "Examples:\n"
      "  esim filter events.raw -o clean.raw --anti-flicker --anti-flicker-low-hz 90 --anti-flicker-high-hz 130\n"
      "  esim filter out/room -o out/edges --trail --trail-threshold-us 5000          the first event of each burst\n"
      "  esim filter events.raw -o clean.h5 --trail-type stc_cut_trail                drops isolated events (noise)\n"
      "  esim filter events.raw -o part.raw --roi 100,50,320,240 --mask-pixel 120,99\n"
      "  esim filter events.h5 -o limited.h5 --rate-controller-events-per-period 1000   at most 5 Mev/s");
  command->callback([arguments, command, &exit_code] { exit_code = run(*arguments, *command); });
}

}  // namespace esim::app
