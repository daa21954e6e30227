// Cyclone's access control without the question whether the program itself may write: what a thief of a
// subscriber's keys loads in place of it. Everybody else still judges by the permissions that were signed.
#include <dds/security/dds_security_api.h>
#include <dlfcn.h>
#include <stddef.h>

struct ddsi_domaingv;
typedef int (*initialiser)(const char*, void**, struct ddsi_domaingv*);
typedef int (*finaliser)(void*);

static void* symbol(const char* name) {
  void* library = dlopen(TUBED_DDS_SECURITY_AC, RTLD_NOW);
  return library == NULL ? NULL : dlsym(library, name);
}

static DDS_Security_boolean allow_writer(dds_security_access_control* instance,
                                         const DDS_Security_PermissionsHandle permissions,
                                         const DDS_Security_DomainId domain, const DDS_Security_char* topic,
                                         const DDS_Security_Qos* qos,
                                         const DDS_Security_PartitionQosPolicy* partition,
                                         const DDS_Security_DataTags* tags,
                                         DDS_Security_SecurityException* exception) {
  (void)instance, (void)permissions, (void)domain, (void)topic, (void)qos, (void)partition, (void)tags;
  (void)exception;
  return true;
}

int init_access_control(const char* argument, void** context, struct ddsi_domaingv* domain) {
  initialiser real;
  *(void**)&real = symbol("init_access_control");
  if (real == NULL || real(argument, context, domain) != 0) return -1;
  ((dds_security_access_control*)*context)->check_create_datawriter = allow_writer;
  return 0;
}

int finalize_access_control(void* context) {
  finaliser real;
  *(void**)&real = symbol("finalize_access_control");
  return real == NULL ? -1 : real(context);
}
