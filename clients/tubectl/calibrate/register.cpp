// tubectl register: from the tracker's frame to the world, by markers.
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "clients/calibration/ball_phantom.hpp"
#include "clients/calibration/marker_collector.hpp"
#include "clients/calibration/registration_report.hpp"
#include "clients/calibration/tip_offset_file.hpp"
#include "clients/evaluation/estimates_csv.hpp"
#include "clients/tubectl/calibrate/accept_options.hpp"
#include "clients/tubectl/calibrate/live_probe.hpp"
#include "clients/tubectl/verbs.hpp"
#include "clients/tubectl/watch/dds_options.hpp"
#include "daemon/config/load_configuration.hpp"
#include "drivers/csv/sequence_error.hpp"
#include "idl/dds_entity.hpp"

namespace tubed {

namespace {

struct RegisterOptions {
  std::string markers;
  std::string phantom;
  std::string axes;
  std::string world_axes;
  std::string touched;
  bool live = false;
  int coil = 1;
  std::vector<double> tip_offset_mm;
  std::string tip_offset_file;
  std::string out_touched;
  bool by_order = false;
  std::vector<std::string> excluded;
  std::optional<double> fle_mm;
  std::string targets;
  std::string tube;
  std::string json;
  Subscription subscription;
  AcceptOptions accept;
};

MarkerAxes axes_of(const std::string& word) {
  return word == "LPS" ? MarkerAxes::kLps : word == "RAS" ? MarkerAxes::kRas : MarkerAxes::kAsWritten;
}

/// The axes of the world that results: those asked for, else LPS where the file says what it has.
MarkerAxes resulting_axes(const RegisterOptions& options, const MarkerFile& world) {
  if (world.axes == MarkerAxes::kAsWritten) {
    if (!options.world_axes.empty()) {
      throw MarkerFileError(world.name +
                            ": nobody said which axes it has, so that it cannot be converted to " +
                            options.world_axes + "; say it with --axes");
    }
    return MarkerAxes::kAsWritten;
  }
  return options.world_axes.empty() ? MarkerAxes::kLps : axes_of(options.world_axes);
}

/// Its balls are the markers, its frame stands for the world.
MarkerFile balls_of(const std::string& file) {
  MarkerFile markers{file, MarkerAxes::kAsWritten, {}};
  for (const PhantomBall& ball : read_ball_phantom(file).balls) {
    markers.markers.push_back({ball.name, ball.p_phantom_mm});
  }
  return markers;
}

MarkerFile read_world(const std::string& file, const RegisterOptions& options) {
  MarkerFile markers = read_markers(file, axes_of(options.axes));
  return along(markers, resulting_axes(options, markers));
}

Eigen::Vector3d tip_offset_mm(const RegisterOptions& options) {
  Eigen::Vector3d offset_mm = Eigen::Vector3d::Zero();
  if (!options.tip_offset_file.empty()) {
    offset_mm = read_tip_offset(options.tip_offset_file);
  } else if (options.tip_offset_mm.size() == 3) {
    offset_mm = Eigen::Map<const Eigen::Vector3d>(options.tip_offset_mm.data());
  }
  if (offset_mm.head<2>().norm() > 1e-9) {
    throw MarkerFileError(
        "the tip offset has a part across the axis, x or y: what a daemon publishes of a coil has no turn "
        "about its "
        "axis, so that only 0,0,z can be used live");
  }
  return offset_mm;
}

std::vector<std::string> names_of(const MarkerFile& world) {
  std::vector<std::string> names;
  for (const Marker& marker : world.markers) names.push_back(marker.name);
  return names;
}

void show(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) std::cerr << line << '\n';
}

/// Markers as a person touches them; each one is in --out-touched at once.
MarkerFile touch(const RegisterOptions& options, const MarkerFile& world) {
  MarkerCollector collector(names_of(world), {.tip_offset_mm = tip_offset_mm(options)});
  LiveProbe probe(options.subscription, options.coil);
  TypedLines typed;
  std::cerr << "Markers: " << list_of(names_of(world), 40)
            << ". Enter asks for the next one, a name for that one, q ends.\n";
  int silent = 0;
  std::size_t written = 0;
  while (!collector.is_finished()) {
    while (const auto line = collector.is_finished() ? std::nullopt : typed.next())
      show(collector.type(*line));
    const auto pose = probe.wait_for(std::chrono::milliseconds{50});
    silent = pose ? 0 : silent + 1;
    if (silent == 100) {
      std::cerr << "no measurement for 5 s: is tubed running in this domain and room?\n";
    }
    if (!pose) continue;
    const auto lines = collector.add(*pose);
    show(lines);
    const bool is_taken = lines.size() > 1;  // the marker, and what comes next
    if (is_taken && !options.out_touched.empty()) {
      write_markers(options.out_touched, collector.markers());
      written = collector.markers().size();
    }
  }
  if (written > 0) std::cerr << written << " touched markers are in " << options.out_touched << ".\n";
  return {"what was touched", MarkerAxes::kAsWritten, collector.markers()};
}

/// What Slicer has of a tracker is in RAS: it takes the numbers that come over OpenIGTLink as such.
MarkerFile read_touched(const std::string& file) { return along(read_markers(file), MarkerAxes::kRas); }

std::vector<TubePlace> tube_of(const std::string& file) {
  const Estimates estimates = read_estimates(file);
  for (auto estimate = estimates.rbegin(); estimate != estimates.rend(); ++estimate) {
    const SampledCentreline& centreline = estimate->second.centreline;
    std::vector<TubePlace> tube;
    for (std::size_t i = 0; i < centreline.s_mm.size(); ++i) {
      tube.push_back({centreline.s_mm[i], centreline.p_world_mm.col(static_cast<Eigen::Index>(i))});
    }
    if (!tube.empty()) return tube;
  }
  throw MarkerFileError(file + ": no estimate in it has a shape");
}

RegistrationContext context_of(const RegisterOptions& options, const MarkerFile& world,
                               const MarkerFile& touched, std::vector<std::string> remarks) {
  RegistrationContext context{world.axes, date_of_today(), {}, {}, {}};
  context.remarks.push_back("markers: " + world.name + "; touched: " + touched.name);
  if (touched.axes != MarkerAxes::kAsWritten) {
    context.remarks.push_back("touched markers are taken in RAS, as Slicer has what a tracker sends");
  }
  context.remarks.insert(context.remarks.end(), remarks.begin(), remarks.end());
  if (!options.targets.empty()) {
    for (const Marker& target : read_world(options.targets, options).markers) {
      context.targets.push_back({target.name, target.p_mm});
    }
  }
  if (!options.tube.empty()) context.tube = tube_of(options.tube);
  return context;
}

/// The tracker's, which a phantom is placed by.
RigidTransform configured_registration(const std::string& file) {
  const RoomDescription room = load_configuration(file).room;
  if (!room.registered) {
    throw MarkerFileError(file +
                          ": [em] has no T_world_em: register the tracker first, then place the phantom");
  }
  return room.T_world_em;
}

/// Where the phantom stands in the world: by markers known in its frame, and by the tracker's registration.
int place_phantom(const JudgedRegistration& judged, const RigidTransform& T_world_em,
                  const RegisterOptions& options) {
  BallPhantom phantom = read_ball_phantom(options.phantom);
  phantom.T_world_phantom = T_world_em * judged.registration.T_world_em.inverse();
  const std::string text = to_toml(phantom);
  if (options.accept.out.empty()) {
    std::cout << text;
    return kExitOk;
  }
  std::ofstream file(options.accept.out, std::ios::trunc);
  file << text;
  file.close();
  if (!file) throw MarkerFileError(options.accept.out + ": cannot be written");
  std::cerr << "The phantom where it stands is in " << options.accept.out
            << "; next: tubectl calibrate camera --phantom " << options.accept.out << "\n";
  return kExitOk;
}

int register_em(const RegisterOptions& options) {
  const bool is_phantom = !options.phantom.empty();
  const RigidTransform T_world_em =
      is_phantom ? configured_registration(options.accept.config) : RigidTransform::Identity();
  const MarkerFile world =
      options.markers.empty() ? balls_of(options.phantom) : read_world(options.markers, options);
  const MarkerFile touched = options.live ? touch(options, world) : read_touched(options.touched);
  PairedMarkers paired =
      pair_markers(world, touched, options.by_order ? Correspondence::kByOrder : Correspondence::kByName,
                   options.excluded);
  const RegistrationContext context = context_of(options, world, touched, std::move(paired.remarks));
  const JudgedRegistration judged = judge_registration(std::move(paired.pairs), options.fle_mm);
  write_report(page_of(judged, context), options.accept);
  const bool is_bad = worst(judged.findings) == ReportVerdict::kBad;
  if (options.json == "-") {
    std::cout << to_json(judged, context).dump(2) << '\n';
    return is_bad ? kExitBadData : offer_beside_json(fragment_of(judged, context), options.accept);
  }
  std::cerr << to_text(judged.findings) << '\n' << to_text(judged, context) << '\n';
  if (is_bad) {
    std::cerr << "tubectl: no registration: see what is WRONG above\n";
    return kExitBadData;
  }
  if (is_phantom) return place_phantom(judged, T_world_em, options);
  return offer(fragment_of(judged, context), options.accept);
}

int checked(const RegisterOptions& options) {
  if (options.live == !options.touched.empty())
    refuse_usage("register", "give either --touched FILE or --live");
  if (options.markers.empty() && options.phantom.empty())
    refuse_usage("register", "give --markers FILE, or --phantom FILE to place a phantom");
  if (!options.phantom.empty() && options.accept.config.empty())
    refuse_usage("register", "--phantom needs --config FILE: where the tracker stands in the world");
  if (!options.phantom.empty() && !options.json.empty())
    refuse_usage("register", "--phantom writes a phantom's file: leave out --json");
  try {
    return register_em(options);
  } catch (const PhantomError& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitBadData;
  } catch (const MarkerFileError& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitBadData;
  } catch (const SequenceError& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitBadData;
  } catch (const DdsError& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitUnavailable;
  }
}

void add_live_options(CommandLine verb, RegisterOptions& options) {
  const char* const heading = "Touching markers now";
  verb.add_flag("--live", options.live, "Touch them now, with a running daemon").group(heading);
  verb.add_option("--coil", options.coil, "Which coil of the instrument the probe is, from its tip")
      .in_range(1, 16)
      .capture_default_str()
      .group(heading);
  Argument offset =
      verb.add_option("--tip-offset", options.tip_offset_mm, "x,y,z of the tip in the coil's frame, mm");
  offset.expected(3, 3).delimiter(',').group(heading);
  verb.add_option("--tip-offset-file", options.tip_offset_file, "The same as `tubectl pivot --out` writes it")
      .excludes(offset)
      .group(heading);
  verb.add_option("--out-touched", options.out_touched,
                  "File for the touched markers, CSV, written after each one")
      .group(heading);
}

}  // namespace

CommandLine add_register(CommandLine app, int& exit_code) {
  auto options = std::make_shared<RegisterOptions>();
  CommandLine verb = app.add_subcommand("register", "Register the EM tracker to the world by markers");
  verb.add_option("--markers", options->markers,
                  "Markers in the world: CSV (name,x,y,z), .mrk.json or .fcsv");
  verb.add_option(
      "--phantom", options->phantom,
      "Place this phantom instead: --markers, or its balls, are known in its own frame, and --out "
      "gets its file with T_world_phantom; --config says where the tracker stands");
  verb.add_option("--touched", options->touched,
                  "The same markers, touched in the tracker's frame, likewise");
  verb.add_option("--axes", options->axes, "Axes of --markers and --targets when they are CSV: LPS or RAS")
      .is_member({"LPS", "RAS"});
  verb.add_option("--world-axes", options->world_axes,
                  "Axes of the world that results (default LPS, if it is known)")
      .is_member({"LPS", "RAS"});
  verb.add_flag("--by-order", options->by_order,
                "The first touched marker is the first of --markers, and so on");
  verb.add_option("--exclude", options->excluded, "Leave out this marker; several: --exclude M2,M5")
      .delimiter(',');
  verb.add_option("--fle", options->fle_mm, "Error of a touch and its marker that is known, RMS in 3D, mm")
      .positive();
  verb.add_option("--targets", options->targets,
                  "Points in the world at which the expected error is asked for");
  verb.add_option("--tube", options->tube,
                  "Estimates of `tubectl reconstruct`: expected error along the last shape");
  verb.add_option("--json", options->json, "- for the findings as JSON on standard output").is_member({"-"});
  add_live_options(verb, *options);
  add_dds_options(verb, options->subscription);
  add_accept_options(verb, options->accept);
  verb.callback([options, &exit_code] { exit_code = checked(*options); });
  return verb;
}

}  // namespace tubed
