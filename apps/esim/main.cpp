#include <cstdio>
#include <exception>

#include "commands.h"
#include "esim/core/error.h"
#include "remedies.h"

int main(int argc, char** argv) {
  using namespace esim::app;
  CLI::App app{"An open event-camera simulator.", "esim"};
  app.set_version_flag("--version", ESIM_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  esim simulate scenes/room.yaml --out out/room     simulate; then look at out/room/cam0/preview.png\n"
      "  esim simulate scenes/room.yaml --out out/low --set event_camera.contrast_threshold=0.2\n"
      "  esim resense out/room --out out/high --set event_camera.contrast_threshold=0.4   new events, no rendering\n"
      "  esim sweep scenes/room.yaml --over event_camera.contrast_threshold=0.2,0.3 --out out/sweep\n"
      "  esim check scenes/room.yaml                       check a scenario without writing anything\n"
      "  esim video clip.mp4 --out out/clip                events of a video, or of a folder of images\n"
      "  esim convert out/room room.bag                    other formats: esim convert --list\n"
      "  esim filter events.raw -o clean.raw --trail       digital filters of event cameras, on any recording\n"
      "  esim import room.blend --bake                     path-traced lighting for fast rendering, by Blender\n"
      "  esim info out/room                                the contents of a recording\n"
      "  esim play out/room                                a video of a recording or of an event file\n"
      "  esim stats out/room --plot                        rates, intervals, hot pixels, banding of its events\n"
      "  esim fit --static wall.raw --out my_sensor        parameters of a sensor from its recordings\n"
      "  esim dataset affine --out out/flow                10,000 sequences with optical flow, for learning\n"
      "  esim studio scenes/room.yaml                      design, make and view recordings in a browser\n"
      "  esim evaluate sampling --out out/sampling         accuracy and cost of sampling methods\n"
      "  esim scenes --copy scenes                         a copy of the scenes that come with esim\n"
      "  esim docs                                         where the documentation is\n"
      "  esim options                                      every option of a scenario\n"
      "\n"
      "Exit status: 0 success, 1 internal error, 2 error in the input or on this machine, 130 interrupted.");

  int exit_code = kOk;
  add_simulate(app, exit_code);
  add_resense(app, exit_code);
  add_sweep(app, exit_code);
  add_video(app, exit_code);
  add_serve(app, exit_code);
  add_check(app, exit_code);
  add_convert(app, exit_code);
  add_filter(app, exit_code);
  add_import(app, exit_code);
  add_info(app, exit_code);
  add_play(app, exit_code);
  add_stats(app, exit_code);
  add_compare(app, exit_code);
  add_characterise(app, exit_code);
  add_fit(app, exit_code);
  add_studio(app, exit_code);
  add_dataset(app, exit_code);
  add_evaluate(app, exit_code);
  add_scenes(app, exit_code);
  add_docs(app, exit_code);
  add_options(app, exit_code);
  add_removed(app);
  try {
    app.parse(argc, argv);
    return exit_code;
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "esim: %s\n", problem_of(error, app).c_str());
    return kUsersFault;
  } catch (const esim::RemediableError& error) {
    std::fprintf(stderr, "esim: %s\n", with_remedy(error.what(), error.remedy(), app).c_str());
    return kUsersFault;
  } catch (const esim::UserError& error) {
    std::fprintf(stderr, "esim: %s\n", error.what());
    return kUsersFault;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "esim: out of memory; use smaller images, a smaller scene, or a machine with more memory\n");
    return kUsersFault;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "esim: internal error: %s; please report it with the command that led to it\n", error.what());
    return kOurFault;
  }
}
