namespace posed {}  // namespace posed
