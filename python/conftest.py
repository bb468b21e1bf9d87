pytest_plugins = ["pytester", "lkemu.pytest_plugin"]
