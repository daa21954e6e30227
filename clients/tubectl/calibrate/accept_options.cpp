#include "clients/tubectl/calibrate/accept_options.hpp"

#include <fstream>
#include <iostream>

#include "clients/tubectl/verbs.hpp"

namespace tubed {

namespace {

constexpr const char* kHeading = "What becomes of it";

void write_file(const std::string& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) {
    throw std::runtime_error(file + " cannot be written");
  }
}

void show(const AcceptedFragment& accepted, const std::string& file) {
  std::cerr << "\nIn " << file << ":\n";
  for (const ChangedValue& change : accepted.changes) {
    std::cerr << "  " << change.path << '\n'
              << "    is        " << (change.before.empty() ? "not there" : change.before) << '\n'
              << "    would be  "
              << (change.replaced_by.empty() ? change.after
                                             : "commented out: " + change.replaced_by + " takes its place")
              << '\n';
  }
}

bool is_wanted(const std::string& file) {
  std::cerr << "Write this into " << file << "? [y/N] " << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "Y" || answer == "yes";
}

void write(const AcceptedFragment& accepted, const std::string& file) {
  const auto copy = replace_configuration(file, accepted.text);
  std::cerr << "Written; what it was before is " << copy.string() << ".\n"
            << "Next: `tubed --check " << file
            << "`, then `systemctl restart tubed`; a camera's pose alone takes `systemctl reload tubed`.\n";
}

int put_into_configuration(const ConfigurationFragment& fragment, const AcceptOptions& options) {
  const AcceptedFragment accepted = accept_into(options.config, fragment);
  if (accepted.changes.empty()) {
    std::cerr << options.config << " says this already.\n";
    return kExitOk;
  }
  show(accepted, options.config);
  if (!options.yes && !is_wanted(options.config)) {
    std::cerr << "Nothing was written.\n";
    return kExitOk;
  }
  write(accepted, options.config);
  return kExitOk;
}

}  // namespace

void add_fragment_options(CommandLine verb, AcceptOptions& options) {
  verb.add_option("--config", options.config,
                  "Configuration that takes what was found; shown and asked before")
      .group(kHeading);
  verb.add_flag("--yes", options.yes, "Write into --config without asking").group(kHeading);
  verb.add_option("--out", options.out, "File for what was found, as a fragment of TOML").group(kHeading);
}

void add_accept_options(CommandLine verb, AcceptOptions& options) {
  add_fragment_options(verb, options);
  verb.add_option("--report", options.report, "File for a page about it, SVG").group(kHeading);
}

int offer(const ConfigurationFragment& fragment, const AcceptOptions& options) {
  const std::string text = to_toml(fragment);
  std::cout << text << std::flush;
  if (!options.out.empty()) {
    write_file(options.out, text);
  }
  return options.config.empty() ? kExitOk : put_into_configuration(fragment, options);
}

int offer_beside_json(const ConfigurationFragment& fragment, const AcceptOptions& options) {
  std::cout << std::flush;
  if (!options.out.empty()) {
    write_file(options.out, to_toml(fragment));
  }
  if (options.config.empty()) {
    return kExitOk;
  }
  if (!options.yes) {
    std::cerr << "Nothing was written into " << options.config
              << ": with --json nobody is asked; add --yes to write it, or leave out --json to be asked.\n";
    return kExitOk;
  }
  return put_into_configuration(fragment, options);
}

void write_report(const std::string& svg, const AcceptOptions& options) {
  if (!options.report.empty()) {
    write_file(options.report, svg);
    std::cerr << "The report is " << options.report << ".\n";
  }
}

}  // namespace tubed
