set(driver_libraries idl_shm)
set(driver_test_libraries tubed_shm Threads::Threads)
set(driver_place 4)
