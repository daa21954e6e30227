// What every verb that calibrates does with what it found: show it, write it into a file, and into the
// configuration after a look.
#pragma once

#include <string>

#include "clients/calibration/configuration_fragment.hpp"
#include "idl/command_line/command_line.hpp"

namespace tubed {

struct AcceptOptions {
  std::string config;  ///< the configuration that takes it; empty: none
  bool yes = false;    ///< without asking
  std::string out;     ///< a file for the fragment; empty: none
  std::string report;  ///< a file for the page, SVG; empty: none
};

/// Adds --config, --yes and --out to `verb`, which makes no page; they write into `options`, which has to
/// outlive it.
void add_fragment_options(CommandLine verb, AcceptOptions& options);

/// Adds --config, --yes, --out and --report to `verb`; they write into `options`, which has to outlive it.
void add_accept_options(CommandLine verb, AcceptOptions& options);

/// Prints the fragment on standard output and writes it to --out; with --config prints which values change,
/// from what to what, and writes them after a "y" on standard input, or with --yes. Says what to do next
/// (systemctl reload or restart). Returns the verb's exit code: kExitOk also when a person said no.
/// What cannot be written is thrown as std::exception.
int offer(const ConfigurationFragment& fragment, const AcceptOptions& options);

/// The same after --json has printed what was found: standard output is left to that, and nobody is asked:
/// --config takes it with --yes alone, and without is said to have not.
int offer_beside_json(const ConfigurationFragment& fragment, const AcceptOptions& options);

/// Writes the page to --report, where one was asked for, and says so on standard error.
void write_report(const std::string& svg, const AcceptOptions& options);

}  // namespace tubed
