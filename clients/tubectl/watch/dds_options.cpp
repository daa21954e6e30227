#include "clients/tubectl/watch/dds_options.hpp"

namespace tubed {

void add_dds_options(CommandLine verb, Subscription& subscription) {
  const char* const heading = "Where to listen";
  verb.add_option("--domain", subscription.domain, "DDS domain of the daemon")
      .in_range(0, 230)
      .capture_default_str()
      .group(heading);
  verb.add_option("--partition", subscription.partition, "The room, as in the daemon's configuration")
      .group(heading);
  verb.add_option("--interface", subscription.network_interface, "Network interface, name or address")
      .capture_default_str()
      .group(heading);
  verb.add_option("--instrument", subscription.instrument_id, "Only this instrument (default: all)")
      .group(heading);
  verb.add_option("--security", subscription.security,
                  "Folder with keys of your own, made by `tubectl keys`: DDS Security on")
      .group(heading);
}

}  // namespace tubed
