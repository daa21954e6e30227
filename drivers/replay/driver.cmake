set(driver_libraries drivers_csv drivers_png idl_geometry tomlplusplus::tomlplusplus)
set(driver_test_libraries opencv_core opencv_imgcodecs)
set(driver_place 3)
