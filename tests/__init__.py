"""Laws over all objects, then one folder a room of the packages; `objects/` is the one list."""
