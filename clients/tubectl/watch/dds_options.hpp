// The options of every verb that listens to a daemon.
#pragma once

#include "clients/cpp/subscription.hpp"
#include "idl/command_line/command_line.hpp"

namespace tubed {

/// Adds --domain, --partition, --interface, --instrument and --security to `verb`; they write into
/// `subscription`, which has to outlive it.
void add_dds_options(CommandLine verb, Subscription& subscription);

}  // namespace tubed
