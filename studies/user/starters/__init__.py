"""What `discmech new` writes, each as a user would write it."""
