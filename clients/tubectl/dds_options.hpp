// The options of every verb that listens to a daemon.
#pragma once

#include <CLI/CLI.hpp>

#include "clients/cpp/subscription.hpp"

namespace tubed {

/// Adds --domain, --partition, --interface and --instrument to `verb`; they write into `subscription`, which
/// has to outlive it.
void add_dds_options(CLI::App& verb, Subscription& subscription);

}  // namespace tubed
