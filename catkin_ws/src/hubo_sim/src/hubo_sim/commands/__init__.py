"""Commands: the simulator node, the true world, pictures of scenes, worlds that come to rest."""
